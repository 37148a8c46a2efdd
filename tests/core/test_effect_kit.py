"""The kit of effects passes those that are installed and fails, with a sentence, what is broken in one way."""

from typing import ClassVar

import numpy as np
import pytest
from faulty_effects import FAULTS, Drag, Jumps, JumpsALittle, JumpsOnContact, OtherMaterial

from muslin.core.arrays import FloatArray
from muslin.core.effect import Effect
from muslin.core.registry import REGISTRY
from muslin.core.scene import Scene
from muslin.core.simulator import Simulator, World
from muslin.core.testing import check_effect
from muslin.core.testing.checks import run_all
from muslin.core.testing.effects import FADED, effect_checks
from muslin.core.testing.motion import SideForce
from muslin.core.testing.reference import ReferenceSimulator, ReferenceWorld
from muslin.core.testing.stage import Stage


@pytest.mark.parametrize("name", REGISTRY.names("effect"))
def test_every_installed_effect_conforms(name: str) -> None:
    check_effect(REGISTRY.get("effect", name))


def complaints(effect: type[Effect], title: str, simulator: Simulator | None = None) -> list[str | None]:
    """Of the checks of that title, one a kind of body."""
    checks = [c for c in effect_checks(effect, simulator) if (c.title.partition(": ")[2] or c.title) == title]
    return [complaint for _, complaint in run_all(checks)]


@pytest.mark.parametrize(("title", "effect"), [(t, e) for t, faults in FAULTS.items() for e in faults])
def test_each_check_catches_an_effect_broken_in_just_that_way(title: str, effect: type[Effect]) -> None:
    found = complaints(effect, title)
    assert found
    for complaint in found:
        assert complaint is not None
        assert FAULTS[title][effect] in complaint


def test_a_material_of_another_kind_is_caught() -> None:
    cloth, rope, solid = complaints(OtherMaterial, "hooks return what they promise")
    assert cloth is None
    for other in (rope, solid):
        assert other is not None
        assert "on_material makes a ClothMaterial" in other


class RoughWorld(ReferenceWorld):
    """Makes tenths of a millimetre of a rounding error, in whatever touches something."""

    def step(self, held: FloatArray, forces: FloatArray | None, stiffness: FloatArray | None = None) -> None:
        super().step(held, forces, stiffness)
        touching = self._contacts.any(axis=1)
        self._v[touching, :2] += 0.0005 * np.sin(1e13 * self._x[touching, :2])


class Rough(ReferenceSimulator):
    def open(self, scene: Scene) -> World:
        return RoughWorld(scene, self.time_step)


@pytest.mark.parametrize("name", ["adhesion", "gravity-tilt", "viscous-damping"])
def test_a_simulator_that_amplifies_everything_is_not_blamed_on_the_effect(name: str) -> None:
    assert Stage(Rough(), "cloth").amplified > 2 * FADED
    assert not any(complaints(REGISTRY.get("effect", name), "fades out towards zero", Rough()))


@pytest.mark.parametrize("effect", [Jumps, JumpsOnContact, JumpsALittle])
def test_on_such_a_simulator_too_an_effect_that_jumps_is_caught(effect: type[Effect]) -> None:
    """On the table, by more than chance can do; or what that hides, in the air."""
    cloth, rope, _ = complaints(effect, "fades out towards zero", Rough())
    for complaint in (cloth, rope):
        assert complaint is not None
        assert "zero is not its limit" in complaint


def test_no_check_of_the_kit_goes_without_a_fault_that_it_catches() -> None:
    check_effect(Drag)
    check_effect(SideForce)
    assert {c.title.partition(": ")[2] or c.title for c in effect_checks(Drag)} == set(FAULTS)


def test_an_effect_is_not_rolled_out_where_the_simulator_cannot_do_what_it_needs() -> None:
    class Plain(ReferenceSimulator):
        capabilities: ClassVar[frozenset[str]] = frozenset({"table"})

    adhesion = REGISTRY.get("effect", "adhesion")
    for checks, rolled_out in ((effect_checks(adhesion, Plain()), False), (effect_checks(adhesion), True)):
        assert any("zero is exactly off" in c.title for c in checks) == rolled_out
