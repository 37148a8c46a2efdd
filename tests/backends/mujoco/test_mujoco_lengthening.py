"""Edges of a sheet get longer as they turn, and damping must not hold them so."""

from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from muslin.backends.mujoco.lengthening import Lengthening
from muslin.backends.mujoco.shell import stretch_forms
from muslin.core.arrays import FloatArray
from muslin.core.body import cloth_grid
from muslin.core.material import ClothMaterial
from muslin.core.motion import rotate
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.scenarios import preset

BODY = cloth_grid(0.3, 0.2, 5, 4)
MATERIAL = ClothMaterial(areal_density=0.2, stretch_stiffness=300.0, damping_time=0.05)
#: While this lasts, damping holds what edges get longer by.
HELD = patch.object(Lengthening, "force", lambda _, moved, steps: np.zeros(moved.size))


def made_up() -> Lengthening:
    return Lengthening(BODY.elements, BODY.vertices, stretch_forms(BODY, MATERIAL))


def turned(angle: float) -> FloatArray:
    """Displacements of the sheet when it is turned rigidly about an edge, out of its plane."""
    quaternion = np.array([np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0])
    return np.asarray(rotate(quaternion, BODY.vertices) - BODY.vertices)


def forces(*path: FloatArray) -> FloatArray:
    """Of the last of some displacements, one a step."""
    lengthening = made_up()
    return [lengthening.force(moved, 1.0) for moved in path][-1].reshape(-1, 3)


@settings(max_examples=30)
@given(st.floats(0.001, 0.1), st.floats(0.001, 0.1))
def test_it_moves_and_turns_nothing_as_a_whole(first: float, second: float) -> None:
    moved = turned(first + second)
    found = forces(turned(0.0), turned(first), moved)
    size = np.abs(found).max()
    assert size > 0
    assert np.abs(found.sum(axis=0)).max() < 1e-9 * size
    assert np.abs(np.cross(BODY.vertices + moved, found).sum(axis=0)).max() < 1e-9 * size


def test_it_pulls_as_a_sheet_does_that_a_step_straight_on_lengthens() -> None:
    """The better the smaller the angle of a step: a sheet that turns goes along its tangents from where it is."""
    apart = []
    for angle in (0.2, 0.1):
        at = BODY.vertices + turned(angle)
        there = at + angle * np.cross([1.0, 0.0, 0.0], at)
        forms = stretch_forms(BODY, MATERIAL)[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
        ends = BODY.elements[:, [[1, 2], [2, 0], [0, 1]]]
        now, after = (np.diff(x[ends], axis=2)[:, :, 0] for x in (at, there))
        longer = np.sum(after**2 - now**2, axis=2)
        pulls = np.einsum("eab,eb->ea", forms, longer)[..., None] * now
        wanted = np.zeros_like(BODY.vertices)
        np.add.at(wanted, ends[:, :, 0], pulls)
        np.add.at(wanted, ends[:, :, 1], -pulls)
        found = forces(turned(-angle), turned(0.0), turned(angle))
        apart.append(np.abs(found - wanted).max() / np.abs(wanted).max())
    assert apart[0] < 0.03
    assert apart[1] < 0.3 * apart[0]


@pytest.mark.parametrize(
    "path",
    [
        [np.full_like(BODY.vertices, k * 0.01) for k in range(3)],
        [turned(0.0), turned(0.05), turned(0.0)],
    ],
    ids=["moved", "to and fro"],
)
def test_it_leaves_alone_what_does_not_turn_on(path: list[FloatArray]) -> None:
    assert np.abs(forces(*path)).max() < 1e-9


def test_it_goes_with_the_stiffness_that_the_model_has_now() -> None:
    forms = stretch_forms(BODY, MATERIAL)
    whole, half = (Lengthening(BODY.elements, BODY.vertices, forms) for _ in range(2))
    for angle in (0.0, 0.05):
        whole.force(turned(angle), 1.0), half.force(turned(angle), 1.0)
    found = whole.force(turned(0.1), 1.0)
    forms *= 0.5
    assert np.allclose(half.force(turned(0.1), 1.0), 0.5 * found)


@pytest.mark.parametrize("name", ["swing", "carry"])
def test_a_damped_sheet_moves_as_on_the_other_engine(name: str) -> None:
    """At 5 ms, a stiff sheet damped for 0.05 s, and nearer by half than where its damping holds it."""
    scenario = preset(name).scenario()
    material = replace(MATERIAL, stretch_stiffness=800.0, bending_rigidity=8e-5)
    other = rollout(REGISTRY.get("simulator", "pybullet")(), scenario, material).vertices

    def apart() -> float:
        mine = rollout(REGISTRY.get("simulator", "mujoco")(), scenario, material).vertices
        return float(np.sqrt(np.mean(np.sum((mine - other) ** 2, axis=2))))

    near = apart()
    with HELD:
        assert near < 0.5 * apart()


def test_a_sheet_that_is_damped_for_less_than_a_step_is_left_alone() -> None:
    """That much damping is of the scheme, and lets go of it within the next step."""
    scenario, simulator = preset("swing").scenario(), REGISTRY.get("simulator", "mujoco")

    def seen(damping_time: float, held: AbstractContextManager[object]) -> FloatArray:
        with held:
            return rollout(simulator(), scenario, replace(MATERIAL, damping_time=damping_time)).vertices

    assert np.array_equal(seen(0.005, nullcontext()), seen(0.005, HELD))
    assert not np.array_equal(seen(0.006, nullcontext()), seen(0.006, HELD))
