"""Effects of which one is right, and each of the others wrong in one way."""

from typing import ClassVar

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.body import Body
from muslin.core.effect import Effect, GraspShift, NodalForce, StiffnessFactor
from muslin.core.material import ClothMaterial, Material
from muslin.core.motion import Motion
from muslin.core.parameters import Parameter
from muslin.core.scene import Scene
from muslin.core.simulator import State


class Drag(Effect):
    """Right in every way: the faulty ones below differ from it in one."""

    name: ClassVar[str] = "drag"
    acts_on: ClassVar[str] = "force"
    dissipative: ClassVar[bool] = True
    coefficients: ClassVar[tuple[Parameter, ...]] = (Parameter("rate", "1/s", 0.0, 5.0),)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce | None:
        rate = self.values["rate"]
        return lambda time, state: -rate * masses[:, None] * state.velocities


class NoUnit(Drag):
    coefficients: ClassVar[tuple[Parameter, ...]] = (Parameter("rate", "1/s", 1.0, 5.0),)


class Twice(Drag):
    coefficients: ClassVar[tuple[Parameter, ...]] = Drag.coefficients * 2


class NeedsMagic(Drag):
    needs: ClassVar[frozenset[str]] = frozenset({"magic"})


class NeverOff(Drag):
    @property
    def is_off(self) -> bool:
        return False

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        return lambda time, state: -(1.0 + self.values["rate"]) * masses[:, None] * state.velocities


class Swallows(Drag):
    def __init__(self, **values: float) -> None:
        super().__init__(**{k: v for k, v in values.items() if k == "rate"})


class Forgets(Drag):
    def __reduce__(self) -> tuple[type[Effect], tuple[()]]:
        return type(self), ()


class OtherMaterial(Drag):
    def on_material(self, material: Material) -> Material:
        return ClothMaterial() if material.kind != "cloth" else material


class SlowGravity(Drag):
    def on_gravity(self, gravity: FloatArray) -> FloatArray:
        gravity *= 0.9
        return gravity


class NoTurn(Drag):
    def on_obstacles(self, turn: FloatArray) -> FloatArray:
        return turn + np.array([0.0, 0.01, 0.0, 0.0])


class NoMotion(Drag):
    def on_command(self, motion: Motion, time_step: float) -> Motion:
        return None  # type: ignore[return-value]


class FewLoads(Drag):
    def on_loads(self, body: Body, material: Material, loads: FloatArray) -> FloatArray:
        return loads[:-1]


class Lifts(Drag):
    def on_loads(self, body: Body, material: Material, loads: FloatArray) -> FloatArray:
        return loads - 1.0


class BackInTime(Drag):
    def on_clock(self, times: FloatArray) -> FloatArray:
        return times[::-1].copy()


class SeesAll(Drag):
    def on_points(self, points: FloatArray) -> FloatArray:
        return np.nan_to_num(points)


class SeesAside(Drag):
    def on_points(self, points: FloatArray) -> FloatArray:
        return points + 0.01


class WrongShape(Drag):
    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        return lambda time, state: np.zeros(3)


class Writes(Drag):
    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        def force(time: float, state: State) -> FloatArray:
            state.velocities[:] *= -self.values["rate"] * masses[:, None]
            return state.velocities

        return force


class Overflows(Drag):
    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        return lambda time, state: np.where(np.abs(state.velocities) > 5.0, np.inf, 0.0)


class Remembers(Drag):
    """From one rollout to the next."""

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        def force(time: float, state: State) -> FloatArray:
            self.calls = getattr(self, "calls", 0) + 1
            return -self.values["rate"] * masses[:, None] * state.velocities * (1.0 + 1e-3 * self.calls)

        return force


class Presses(Drag):
    """Asks for contact forces without a word."""

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        return lambda time, state: -self.values["rate"] * state.contact_forces()


class Inert(Drag):
    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce | None:
        return None


class Softens(Drag):
    """Without a word, too."""

    def bind_stiffness(self, scene: Scene) -> StiffnessFactor | None:
        return lambda time, state: np.full(len(scene.body.elements), 0.9)


class Drives(Drag):
    """Drags backwards where it is slow."""

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        def force(time: float, state: State) -> FloatArray:
            speed = np.linalg.norm(state.velocities, axis=1, keepdims=True)
            return np.where(speed < 0.5, 1.0, -1.0) * self.values["rate"] * masses[:, None] * state.velocities

        return force


class Stiffens(Drag):
    def on_material(self, material: Material) -> Material:
        grown = "youngs_modulus" if material.kind == "solid" else "stretch_stiffness"
        return type(material)(**{**vars(material), grown: 2.0 * getattr(material, grown)})


class Jumps(Drag):
    """Does not fade out towards zero."""

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        return lambda time, state: -5.0 * masses[:, None] * state.velocities


class JumpsOnContact(Drag):
    """Nor does this, which acts only on what lies on something."""

    acts_on: ClassVar[str] = "contact"
    needs: ClassVar[frozenset[str]] = frozenset({"contact-forces"})

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        def force(time: float, state: State) -> FloatArray:
            touching = state.contact_forces().any(axis=1)
            return np.outer(np.where(touching, 30.0 * masses, 0.0), [1.0, 0.0, 1.0])

        return force


class JumpsALittle(Drag):
    """By less than contact with a rough simulator hides."""

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        return lambda time, state: 0.02 * masses[:, None] * np.array([1.0, 0.0, 0.0])


class Loads(Drag):
    """Mass that is picked up comes with energy."""

    def on_loads(self, body: Body, material: Material, loads: FloatArray) -> FloatArray:
        return loads + self.values["rate"] * 1e-3


class Random(Drag):
    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        factor = self.values["rate"] * (1.0 + 1e-6 * np.random.random())  # noqa: NPY002
        return lambda time, state: -factor * masses[:, None] * state.velocities


class FarGrasp(Drag):
    def bind_grasp(self, scene: Scene, masses: FloatArray) -> GraspShift | None:
        return lambda time, state, target: np.full_like(target, np.nan)


#: Title of a check without the kind -> faulty effects, each with words of the complaint.
FAULTS: dict[str, dict[type[Effect], str]] = {
    "declares itself": {NoUnit: "leaves zero out", Twice: "declared twice", NeedsMagic: "needs must be some of"},
    "is off until told otherwise": {NeverOff: "without values it is not off"},
    "refuses unknown coefficients": {Swallows: "accepts a coefficient"},
    "survives pickle": {Forgets: "has other values"},
    "hooks return what they promise": {
        SlowGravity: "on_gravity writes into",
        NoTurn: "on_obstacles gives a quaternion of length",
        NoMotion: "on_command gives a NoneType",
        FewLoads: "on_loads gives shape",
        Lifts: "negative mass",
        BackInTime: "seen earlier",
        SeesAll: "not seen NaN",
        SeesAside: "off_points does not undo on_points",
    },
    "what it binds is well-formed": {
        WrongShape: "shape",
        Writes: "writes into",
        Overflows: "not finite",
        Remembers: "of a second bind",
        Presses: "asks for contact forces",
        Inert: "bind() gives None",
        Softens: "must name 'varying-stiffness'",
        FarGrasp: "the grasp is not finite",
    },
    "never adds energy": {
        Drives: "it has put",
        Stiffens: "on_material turns",
        Softens: "varies the stiffness",
        Loads: "through on_loads",
    },
    "takes energy in a rollout": {Drives: "it has put"},
    "zero is exactly off": {NeverOff: "differs from the one without"},
    "fades out towards zero": {Jumps: "zero is not its limit", JumpsOnContact: "zero is not its limit"},
    "acts, and repeats": {Inert: "the trajectory is the plain one", Random: "second rollout of the same instance"},
    "global random state untouched": {Random: "NumPy's global random"},
}
