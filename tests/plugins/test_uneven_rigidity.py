"""Ropes that are stiffer in some places than in others."""

from dataclasses import replace

import numpy as np
import pytest
from effect_objects import engine
from hypothesis import given, settings
from hypothesis import strategies as st

from muslin.backends.mujoco.rod import looking_back
from muslin.core.arrays import FloatArray
from muslin.core.bending import rope_rigidities
from muslin.core.body import rope_line
from muslin.core.material import RopeMaterial
from muslin.core.motion import Motion
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.core.scenarios import preset
from muslin.core.scene import Scene
from muslin.core.simulator import State
from muslin.plugins.effects.crease import Crease
from muslin.plugins.effects.grip_load import BendingPull
from muslin.plugins.effects.rope import UnevenRigidity
from muslin.plugins.effects.strands import RopeHysteresis

MATERIAL = RopeMaterial(bending_rigidity=4e-3, twist_rigidity=4e-3, stretch_stiffness=2000.0, damping_time=0.02)
TIME = np.arange(0.0, 0.8, 0.02)
ratios = st.floats(-2.0, 2.0)


def swung() -> Scenario:
    """A rope that hangs between two clamps 0.7 m apart, which swing it across."""
    poses = np.tile([[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], [0.7, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]], (len(TIME), 1, 1))
    poses[:, :, 1] = 0.05 * np.sin(2 * np.pi * 1.5 * TIME)[:, None]
    return replace(preset("cable").scenario((0.9,), (25,)), motion=Motion(TIME, poses), times=TIME)


def path(material: RopeMaterial, *effects: UnevenRigidity | RopeHysteresis, name: str = "mujoco") -> FloatArray:
    return rollout(engine(name), swung(), material, effects).vertices


@settings(max_examples=30)
@given(ratios, ratios)
def test_the_ratios_are_those_that_were_given_and_the_mean_stays(ends: float, far: float) -> None:
    effect = UnevenRigidity(log_end_ratio=ends, log_far_ratio=far)
    rope = effect.on_material(MATERIAL)
    assert isinstance(rope, RopeMaterial)
    first, middle, last = np.log(rope.bending_shares(np.array([0.0, 0.5, 1.0])))
    assert (first + last) / 2 - middle == pytest.approx(ends, abs=1e-9)
    assert last - first == pytest.approx(far, abs=1e-9)
    along = (np.arange(1000) + 0.5) / 1000
    assert np.log(rope.bending_shares(along)).mean() == pytest.approx(0.0, abs=1e-9)
    assert rope.bending_rigidity == MATERIAL.bending_rigidity


@settings(max_examples=30)
@given(ratios, ratios, ratios, ratios)
def test_twice_is_the_sum_of_the_logarithms(ends: float, far: float, more: float, further: float) -> None:
    one = UnevenRigidity(log_end_ratio=ends / 2, log_far_ratio=far / 2)
    other = UnevenRigidity(log_end_ratio=more / 2, log_far_ratio=further / 2)
    both = UnevenRigidity(log_end_ratio=(ends + more) / 2, log_far_ratio=(far + further) / 2)
    twice, once = other.on_material(one.on_material(MATERIAL)), both.on_material(MATERIAL)
    assert isinstance(twice, RopeMaterial) and isinstance(once, RopeMaterial)
    along = np.linspace(0.0, 1.0, 9)
    np.testing.assert_allclose(twice.bending_shares(along), once.bending_shares(along))


@pytest.mark.parametrize("name", ["mujoco", pytest.param("pybullet", marks=pytest.mark.slow)])
def test_a_rope_that_is_stiffer_at_its_far_end_is_its_own_mirror_image(name: str) -> None:
    """Both clamps do the same, so to be stiffer at one end looks as to be stiffer at the other, from behind."""
    one = path(MATERIAL, UnevenRigidity(log_far_ratio=1.5), name=name)
    other = path(MATERIAL, UnevenRigidity(log_far_ratio=-1.5), name=name)
    mirrored = one[:, ::-1] * [-1.0, 1.0, 1.0] + [0.7, 0.0, 0.0]
    moved = np.abs(one - path(MATERIAL, name=name)).max()
    assert moved > 4e-3
    assert np.abs(mirrored - other).max() < 0.02 * moved


def test_what_effects_make_of_a_bend_is_of_the_rigidity_where_it_is() -> None:
    """A rope that is bent at one vertex: a crease there, and what it pulls at a grasp, go with the rigidity there."""
    line = rope_line(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), 11)
    uneven = replace(MATERIAL, end_bending_ratio=0.2, far_bending_ratio=3.0)
    shares = rope_rigidities(line, uneven) / MATERIAL.bending_rigidity
    for place in (1, 5, 9):
        bent = line.vertices.copy()
        bent[place + 1 :] = bent[place] + 0.05 * np.arange(1, 11 - place)[:, None] * [np.cos(0.8), np.sin(0.8), 0.0]

        def made(material: RopeMaterial, bent: FloatArray = bent) -> tuple[FloatArray, FloatArray]:
            scene = Scene(line, material, np.zeros(3), (), np.zeros(11))
            crease = Crease(yield_radius=0.1).bind(scene, np.ones(11))
            return crease(0.0, State(bent, 0.0 * bent)), BendingPull(scene)(bent)

        for own, even in zip(made(uneven), made(MATERIAL), strict=True):
            np.testing.assert_allclose(own, shares[place - 1] * even, atol=1e-9)
        assert np.abs(made(MATERIAL)[0]).max() > 0.0


def test_a_rope_looks_back_as_far_as_its_softest_place_allows() -> None:
    angle = np.linspace(0.0, 4.0, 21)
    body = rope_line(0.1 * np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1), 21)
    uneven = replace(MATERIAL, end_bending_ratio=0.1)
    soft = replace(MATERIAL, bending_rigidity=float(rope_rigidities(body, uneven).min()))
    held = np.array([0, 1])
    found = [looking_back(body, rope, held, 0.005) for rope in (uneven, soft, MATERIAL)]
    assert found[0] == pytest.approx(found[1])
    assert found[0] < 0.9 * found[2]


def test_what_strands_lose_as_they_slide_is_as_uneven() -> None:
    """Strands that slide at once leave half of twice the rigidity, everywhere."""
    uneven = UnevenRigidity(log_end_ratio=1.5, log_far_ratio=1.0)
    stiffer = replace(MATERIAL, bending_rigidity=2 * MATERIAL.bending_rigidity)
    strands = RopeHysteresis(sliding_share=0.5, slip_curvature=0.0)
    slid, softer, stuck = path(stiffer, uneven, strands), path(MATERIAL, uneven), path(stiffer, uneven)
    np.testing.assert_allclose(path(stiffer, strands, uneven), slid, atol=1e-9)
    assert np.abs(slid - softer).max() < 0.3 * np.abs(stuck - softer).max()
