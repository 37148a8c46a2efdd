"""The kits pass what is right and fail, with a sentence, what is broken in one way."""

import random
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar, cast

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.extractor import KeypointExtractor
from muslin.core.material import with_fields
from muslin.core.registry import REGISTRY
from muslin.core.scene import Scene
from muslin.core.series import PointSeries
from muslin.core.simulator import CAPABILITIES, Simulator, State, World
from muslin.core.testing import KITS, check_extractor, check_simulator, run_checks
from muslin.core.testing.checks import run_all
from muslin.core.testing.reference import ReferenceSimulator, ReferenceWorld
from muslin.core.testing.simulators import simulator_checks


def test_the_reference_simulator_conforms() -> None:
    check_simulator(ReferenceSimulator)


@pytest.mark.parametrize("name", REGISTRY.names("extractor"))
def test_every_installed_extractor_conforms(name: str) -> None:
    check_extractor(REGISTRY.get("extractor", name))


class Faulty(ReferenceSimulator):
    """Breaks one promise, chosen by name."""

    def __init__(self, fault: str = "", time_step: float = 0.005) -> None:
        super().__init__(time_step)
        self.fault = fault
        if fault == "nameless engine":
            self.engine_version = lambda: ""  # type: ignore[method-assign]

    def check(self, scene: Scene) -> None:
        if self.fault != "takes all":
            super().check(scene)

    def open(self, scene: Scene) -> World:
        if self.fault == "anisotropy":
            scene = replace(scene, material=with_fields(cast(Any, scene.material), {"weft_stretch_ratio": 1.0}))
        if self.fault == "rest is start" and scene.start is not None:
            scene = replace(scene, body=replace(scene.body, vertices=scene.start))
        return FaultyWorld(scene, self.fault, self.time_step)


class FaultyWorld(ReferenceWorld):
    def __init__(self, scene: Scene, fault: str, time_step: float) -> None:
        super().__init__(scene, time_step)
        self.fault = fault
        self.last: FloatArray | None = None
        self.shape = scene.body.vertices
        if fault == "gravity":
            self._gravity = self._gravity * 1.02
        if fault == "masses":
            self.masses = self.masses * 1.1
        if fault == "start":
            self._x = self._x[::-1].copy()
        if fault == "stiffness":
            self._elasticity = 1.1 * self._elasticity
        if fault == "at rest":
            self._v = np.zeros_like(self._v)
        if fault == "straight rest":
            self._gravity = self._gravity + np.array([0.0, 0.3, 0.3])
        if fault == "friction of one":
            self._obstacles = [(o, friction / o.friction) for o, friction in self._obstacles]
        if fault == "no friction":
            self._obstacles = [(o, 0.0) for o, _ in self._obstacles]
        if fault == "no obstacle":
            self._obstacles = []

    def step(self, held: FloatArray, forces: FloatArray | None, stiffness: FloatArray | None = None) -> None:
        if self.fault == "force lingers":
            forces = self.last if forces is None else forces
            self.last = forces
        if self.fault == "force lost":
            forces = None
        if self.fault == "half balance" and forces is not None and self._gravity.any():
            forces = 0.99 * forces
        if self.fault == "global random":
            np.random.random()  # noqa: NPY002
        if self.fault == "python random":
            random.random()
        if self.fault == "not repeatable":
            self._v = self._v + np.random.default_rng().normal(0, 1e-9, self._v.shape)
        if self.fault == "damping a step":
            self._v = 0.97 * self._v
        if self.fault == "stiffness of all" and stiffness is not None:
            stiffness = np.full_like(stiffness, stiffness.mean())
        super().step(held, forces, stiffness)
        if self.fault == "held" and len(held):
            self._x[self._held] += 1e-6
        if self.fault == "nan":
            self._x[-1] = np.nan
        if self.fault == "contact forces a step":
            self._contacts = self._contacts * self.time_step

    def state(self) -> State:
        if self.fault == "shape":
            return State(self._x[:-1], self._v)
        return super().state()


#: Title of a check without the kind -> faults, each with words of the complaint.
FAULTS: dict[str, dict[str, str]] = {
    "starts as the scene says": {
        "masses": "add up to",
        "start": "from where the scene has it",
        "shape": "have shape",
    },
    "held vertices are exact": {"held": "it must be exact", "nan": "not finite"},
    "free fall": {"gravity": "off a t"},
    "nodal forces accelerate": {"force lost": "off a t"},
    "nodal forces balance gravity": {"half balance": "off a t"},
    "a force ends with its step": {
        "force lingers": "after the force has ended",
        "force lost": "m/s from acceleration x step",
    },
    "stretches as its stiffness says": {"stiffness": "times as much"},
    "refines with the time step": {"damping a step": "half of it still"},
    "repeats bit for bit": {"not repeatable": "second rollout differs"},
    "an effect at zero changes nothing": {"force lost": "moves nothing", "not repeatable": "changes it"},
    "global random state untouched": {"global random": "NumPy's global", "python random": "Python's global"},
    **{
        title: faults
        for name in ("table", "cylinder", "static-mesh")
        for title, faults in {
            f"a {name} carries it at its surface": {"no obstacle": f"mm above the {name}"},
            f"sticks to a {name} on a gentle slope": {"no friction": "it slides"},
            f"slides down a {name} on a steep one": {"friction of one": "it gains 5."},
        }.items()
    },
    "contact forces change its momentum": {"contact forces a step": "miss 9"},
    "is stiffer along the weft if told so": {"anisotropy": "along the warp as without"},
    "refused where it needs 'uneven-rope', which is not claimed": {"takes all": "lets a scene pass that needs"},
    "keeps a curved rest shape": {"straight rest": "without any force"},
    "starts away from its rest shape": {"rest is start": "off its rest length"},
    "starts in motion": {"at rest": "off the velocity", "damping a step": "thrown without weight"},
    "changes its stiffness when told": {"stiffness of all": "near the grasp"},
}


def complaints(make: Callable[..., Simulator], title: str) -> dict[str, str | None]:
    """Complaint by kind of body of the checks of that title."""
    checks = [c for c in simulator_checks(make) if c.title.partition(": ")[2] == title]
    return {name.partition(":")[0]: complaint for name, complaint in run_all(checks)}


@pytest.mark.parametrize(("title", "fault"), [(t, f) for t, faults in FAULTS.items() for f in faults])
def test_each_check_catches_a_simulator_broken_in_just_that_way(title: str, fault: str) -> None:
    found = complaints(partial(Faulty, fault), title)
    assert found
    for complaint in found.values():
        assert complaint is not None
        assert FAULTS[title][fault] in complaint


def test_no_check_of_the_kit_goes_without_a_fault_that_it_catches() -> None:
    """Others are: what it declares, refusals, and what only ropes do, each with a test below."""
    titles = {c.title.partition(": ")[2] or c.title for c in simulator_checks(ReferenceSimulator)}
    assert titles - {"declares its name, kinds and engine version"} == set(FAULTS)


def test_a_simulator_that_does_not_say_what_it_is() -> None:
    with pytest.raises(AssertionError, match=r"engine_version\(\) must name"):
        simulator_checks(partial(Faulty, "nameless engine"))[0].run()
    with pytest.raises(AssertionError, match="capabilities must be some of"):
        simulator_checks(type("Flies", (ReferenceSimulator,), {"capabilities": frozenset({"fly"})}))[0].run()


class ClothOnly(ReferenceSimulator):
    """Can do nothing but plain cloth, and says so."""

    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth"})
    capabilities: ClassVar[frozenset[str]] = frozenset()


class TakesAll(ClothOnly):
    def check(self, scene: Scene) -> None:
        return None


def test_what_is_not_claimed_must_be_refused() -> None:
    check_simulator(ClothOnly)
    refusals = [c for c in simulator_checks(TakesAll) if "refused" in c.title]
    told = dict(run_all(refusals))
    assert told["solid: refused, as it is not claimed"] == "check() lets a solid pass, which is not in object_kinds"
    needs = ("table", "cylinder", "static-mesh", "anisotropy", "curved-rest", "start-shape", "start-velocity")
    assert len(told) == 2 + len(needs)
    for need in needs:
        complaint = told[f"cloth: refused where it needs {need!r}, which is not claimed"]
        assert complaint == f"check() lets a scene pass that needs {need!r}, which is not in capabilities"


def test_a_rope_that_is_as_stiff_everywhere_is_caught_where_it_must_not_be() -> None:
    pytest.importorskip("mujoco")
    from muslin.backends.mujoco import MujocoSimulator

    class Even(MujocoSimulator):
        def open(self, scene: Scene) -> World:
            fields = {"end_bending_ratio": 1.0, "far_bending_ratio": 1.0}
            return super().open(replace(scene, material=with_fields(cast(Any, scene.material), fields)))

    complaint = complaints(Even, "bends more where it is softer")["rope"]
    assert complaint is not None
    assert "gives way 1.00 times as much as without, not 1.26 times" in complaint


class Untwisted(ReferenceSimulator):
    """Claims a torsion that it does not have."""

    capabilities: ClassVar[frozenset[str]] = frozenset(CAPABILITIES)


def test_torsion_that_is_only_claimed_is_caught() -> None:
    complaint = complaints(Untwisted, "resists torsion")["rope"]
    assert complaint is not None
    assert "of a quarter of the twist rigidity gives way 1.00 times as much, not 1.94" in complaint


def test_a_twist_at_the_start_that_is_left_out_is_caught() -> None:
    pytest.importorskip("mujoco")
    from muslin.backends.mujoco import MujocoSimulator

    class Starts(MujocoSimulator):
        def open(self, scene: Scene) -> World:
            return super().open(replace(scene, start_twist=0.0))

    assert complaints(MujocoSimulator, "starts twisted")["rope"] is None
    complaint = complaints(Starts, "starts twisted")["rope"]
    assert complaint is not None
    assert "started twisted by 2 rad it comes to rest" in complaint


def test_a_simulator_that_cannot_travel() -> None:
    class Local(ReferenceSimulator):
        pass

    complaint = complaints(Local, "repeats bit for bit")["rope"]
    assert complaint is not None
    assert "cannot be pickled" in complaint


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
    rows = list(run_checks("extractor", MakesUp))
    assert [t for t, error in rows if error]
    assert len(rows) > 3
    unbuildable: Callable[[], Simulator] = lambda: 1 / 0  # type: ignore[return-value]  # noqa: E731
    [(title, error)] = run_checks("simulator", unbuildable)
    assert title == "can be built without options"
    assert error is not None and "ZeroDivisionError" in error
    assert {"simulator", "effect", "extractor"} <= set(KITS)
