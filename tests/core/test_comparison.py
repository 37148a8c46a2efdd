"""The same draws on several simulators."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest

from muslin.core.comparison import compare_simulators
from muslin.core.errors import InputError, RolloutFailed
from muslin.core.material import ClothMaterial
from muslin.core.obstacles import Table
from muslin.core.parameters import Parameter
from muslin.core.scenarios import preset
from muslin.core.scene import Scene
from muslin.core.simulator import World
from muslin.core.testing.reference import ReferenceSimulator

STIFFNESS = Parameter("stretch_stiffness", "N/m", 10.0, 40.0)
DENSITY = Parameter("areal_density", "kg/m2", 0.1, 0.3)


class Softer(ReferenceSimulator):
    """Half the stiffness that is asked for."""

    name: ClassVar[str] = "softer"

    def open(self, scene: Scene) -> World:
        assert isinstance(scene.material, ClothMaterial)
        half = scene.material.stretch_stiffness / 2
        return super().open(replace(scene, material=replace(scene.material, stretch_stiffness=half)))


class Fragile(ReferenceSimulator):
    """Breaks where the stiffness is in the upper half of the prior."""

    name: ClassVar[str] = "fragile"

    def open(self, scene: Scene) -> World:
        assert isinstance(scene.material, ClothMaterial)
        if scene.material.stretch_stiffness > 25.0:
            raise RolloutFailed("too stiff for me")
        return super().open(scene)


@pytest.fixture(scope="module")
def hanging():
    scenario = preset("hang").scenario(vertices=(4, 4))
    return replace(scenario, times=scenario.times[:16])


def run(hanging, *simulators, **more):
    return compare_simulators(hanging, simulators, 9, parameters=[STIFFNESS, DENSITY], workers=0, **more)


def test_a_simulator_is_no_distance_from_itself_and_as_sensitive(hanging):
    class Twin(ReferenceSimulator):
        name: ClassVar[str] = "twin"

    found = run(hanging, ReferenceSimulator(), Twin())
    one, other = found.runs
    assert not found.difference(one, other).any()
    np.testing.assert_allclose(found.alike(one, other), 1.0)
    np.testing.assert_array_equal(one.vertices, other.vertices)


def test_half_the_stiffness_is_seen_where_it_matters(hanging):
    """A sheet stretches by its weight over its stiffness: most on the soft side of the prior, in the same way."""
    found = run(hanging, ReferenceSimulator(), Softer())
    one, other = found.runs
    soft, _, stiff = found.by_region(one, other)[0]
    assert soft > 1.5 * stiff > 0
    stretch, weight = one.sensitivity(found.unit_draws)[0]
    assert stretch > 0 and weight > 0
    assert other.sensitivity(found.unit_draws)[0][0] > stretch
    assert found.alike(one, other)[0] > 0.7  # not 1: a softer sheet moves in its own rhythm too


def test_failed_draws_are_counted_with_their_reason_and_left_out(hanging):
    found = run(hanging, ReferenceSimulator(), Fragile())
    _, fragile = found.runs
    stiff = found.space.from_unit(found.unit_draws)[:, 0] > 25.0
    assert sorted(fragile.failures) == np.flatnonzero(stiff).tolist()
    np.testing.assert_array_equal(fragile.whole, ~stiff)
    np.testing.assert_array_equal(np.isnan(found.difference(*found.runs)).all(axis=1), stiff)
    table = found.to_json()["simulators"]["fragile"]
    assert (table["failed"], table["reasons"]) == (int(stiff.sum()), ["too stiff for me"])
    assert "too stiff for me" in found.text()


@pytest.mark.parametrize("draws", [1, 2])
def test_what_few_draws_cannot_tell_is_said_and_not_printed_as_a_number(hanging, draws):
    found = compare_simulators(
        hanging, [ReferenceSimulator(), Softer()], draws, parameters=[STIFFNESS, DENSITY], workers=0
    )
    assert "nan" not in found.text()
    assert "\u2013: too few draws ended well to tell; 12 or more would do" in found.text()
    assert "0.0 mm apart (median" not in found.text()  # what can be told is told


def test_draws_are_the_same_every_time_and_fill_the_prior(hanging):
    first, again = (run(hanging, ReferenceSimulator(), Softer(), seed=3).unit_draws for _ in range(2))
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(np.sort((first * 9).astype(int), axis=0), np.tile(np.arange(9)[:, None], (1, 2)))


def test_what_cannot_be_compared_is_said(hanging):
    class Bare(ReferenceSimulator):
        name: ClassVar[str] = "bare"
        capabilities: ClassVar[frozenset[str]] = frozenset()

    with pytest.raises(InputError, match="'bare' cannot carry the object on a table"):
        run(replace(hanging, obstacles=(Table(0.0),)), ReferenceSimulator(), Bare())
    with pytest.raises(InputError, match="at least two different"):
        run(hanging, ReferenceSimulator())
    with pytest.raises(InputError, match="at least two different"):
        run(hanging, ReferenceSimulator(), ReferenceSimulator())
