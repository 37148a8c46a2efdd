"""The kits pass what is right and fail, with a sentence, what is broken in one way."""

import random
from collections.abc import Callable
from typing import ClassVar

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.effect import Effect, NodalForce
from muslin.core.extractor import KeypointExtractor
from muslin.core.parameters import Parameter
from muslin.core.registry import REGISTRY
from muslin.core.scene import Scene
from muslin.core.series import PointSeries
from muslin.core.simulator import Simulator, State, World
from muslin.core.testing import KITS, check_effect, check_extractor, check_simulator, run_checks
from muslin.core.testing.reference import ReferenceSimulator, ReferenceWorld
from muslin.core.testing.simulators import SideForce


def test_the_reference_simulator_conforms() -> None:
    check_simulator(ReferenceSimulator)


@pytest.mark.parametrize("name", REGISTRY.names("effect"))
def test_every_installed_effect_conforms(name: str) -> None:
    check_effect(REGISTRY.get("effect", name))


@pytest.mark.parametrize("name", REGISTRY.names("extractor"))
def test_every_installed_extractor_conforms(name: str) -> None:
    check_extractor(REGISTRY.get("extractor", name))


class Faulty(ReferenceSimulator):
    """Breaks one promise, chosen by name."""

    def __init__(self, fault: str = "") -> None:
        self.fault = fault

    def open(self, scene: Scene) -> World:
        return FaultyWorld(scene, self.fault)


class FaultyWorld(ReferenceWorld):
    def __init__(self, scene: Scene, fault: str) -> None:
        super().__init__(scene)
        self.fault = fault
        self.last: FloatArray | None = None
        if fault == "gravity":
            self._gravity = self._gravity * 1.02
        if fault == "masses":
            self.masses = self.masses * 1.1
        if fault == "start":
            self._x = self._x[::-1].copy()

    def step(self, held: FloatArray, forces: FloatArray | None) -> None:
        if self.fault == "force lingers":
            forces = self.last if forces is None else forces
            self.last = forces
        if self.fault == "force lost":
            forces = None
        if self.fault == "global random":
            np.random.random()  # noqa: NPY002
        if self.fault == "python random":
            random.random()
        if self.fault == "not repeatable":
            self._v = self._v + np.random.default_rng().normal(0, 1e-9, self._v.shape)
        if self.fault == "no table":
            self._table = None
        super().step(held, forces)
        if self.fault == "held" and len(held):
            self._x[self._held] += 1e-6
        if self.fault == "nan":
            self._x[-1] = np.nan

    def state(self) -> State:
        if self.fault == "shape":
            return State(self._x[:-1], self._v)
        return super().state()


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("gravity", "free fall"),
        ("masses", "add up to"),
        ("start", "from where the scene has it"),
        ("force lingers", "after the force has ended"),
        ("force lost", "nodal forces accelerate"),
        ("global random", "NumPy's global random"),
        ("python random", "Python's global random"),
        ("not repeatable", "second rollout differs"),
        ("no table", "below the table"),
        ("held", "it must be exact"),
        ("nan", "not finite"),
        ("shape", "have shape"),
    ],
)
def test_the_kit_catches_a_faulty_simulator(fault: str, words: str) -> None:
    with pytest.raises(AssertionError, match=words):
        check_simulator(lambda: Faulty(fault))


class ClothOnly(ReferenceSimulator):
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth"})


class TakesAll(ClothOnly):
    def check(self, scene: Scene) -> None:
        return None


def test_kinds_that_are_not_claimed_must_be_refused() -> None:
    check_simulator(ClothOnly)
    with pytest.raises(AssertionError, match="lets a solid pass"):
        check_simulator(TakesAll)


def test_a_simulator_that_cannot_travel() -> None:
    class Local(ReferenceSimulator):
        pass

    with pytest.raises(AssertionError, match="cannot be pickled"):
        check_simulator(Local)


class Jumps(SideForce):
    """Does not fade out towards zero."""

    name: ClassVar[str] = "jumps"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        pull = 5.0 * masses[:, None] * np.array([1.0, 0.0, 0.0])
        return lambda time, positions, velocities: pull


class NeverOff(SideForce):
    name: ClassVar[str] = "never-off"

    @property
    def is_off(self) -> bool:
        return False

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        pull = (1.0 + self.values["acceleration"]) * masses[:, None] * np.array([1.0, 0.0, 0.0])
        return lambda time, positions, velocities: pull


class WrongShape(SideForce):
    name: ClassVar[str] = "wrong-shape"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        return lambda time, positions, velocities: np.zeros(3)


class Writes(SideForce):
    name: ClassVar[str] = "writes"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        def force(time: float, positions: FloatArray, velocities: FloatArray) -> FloatArray:
            velocities *= self.values["acceleration"] * masses[:, None]
            return velocities

        return force


class Inert(SideForce):
    name: ClassVar[str] = "inert"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce | None:
        return None


class NoZero(SideForce):
    name: ClassVar[str] = "no-zero"
    coefficients: ClassVar[tuple[Parameter, ...]] = (Parameter("acceleration", "m/s2", 1.0, 5.0),)


class Swallows(SideForce):
    name: ClassVar[str] = "swallows"

    def __init__(self, **values: float) -> None:
        super().__init__(**{k: v for k, v in values.items() if k == "acceleration"})


class Twice(SideForce):
    name: ClassVar[str] = "twice"
    coefficients: ClassVar[tuple[Parameter, ...]] = (Parameter("acceleration", "m/s2", 0.0, 5.0),) * 2


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        (Jumps, "zero is not its limit"),
        (NeverOff, "without values it is not off"),
        (NeverOff, "differs from the one without"),
        (WrongShape, "shape"),
        (Writes, "writes into"),
        (Inert, "the trajectory is the plain one"),
        (Inert, "bind.. gives None"),
        (NoZero, "leaves zero out"),
        (Swallows, "accepts a coefficient"),
        (Twice, "declared twice"),
    ],
)
def test_the_kit_catches_a_faulty_effect(effect: type[Effect], words: str) -> None:
    check_effect(SideForce)
    with pytest.raises(AssertionError, match=words):
        check_effect(effect)


class MakesUp(KeypointExtractor):
    name: ClassVar[str] = "makes-up"
    needs_images: ClassVar[bool] = False

    def extract(self, source: object, time: FloatArray) -> PointSeries:
        assert isinstance(source, PointSeries)
        return PointSeries(source.time, np.nan_to_num(source.points))


def test_the_kit_catches_a_faulty_extractor() -> None:
    with pytest.raises(AssertionError, match="none was seen"):
        check_extractor(MakesUp)


def test_the_runner_names_every_check_and_never_raises() -> None:
    rows = list(run_checks("simulator", lambda: Faulty("held")))
    assert [t for t, error in rows if error] == ["cloth: held vertices are exact", "solid: held vertices are exact"]
    assert len(rows) > 15
    unbuildable: Callable[[], Simulator] = lambda: 1 / 0  # type: ignore[return-value]  # noqa: E731
    [(title, error)] = run_checks("simulator", unbuildable)
    assert title == "can be built without options"
    assert error is not None and "ZeroDivisionError" in error
    assert {"simulator", "effect", "extractor"} <= set(KITS)
