"""What the cases are made of: an object, what stands around it, and motions that are fitted or held out."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.motion import Motion
from muslin.core.scenarios import fling_motion, smooth_path, swing_motion
from muslin.core.study.config import ParameterTable
from muslin.core.study.scenario_table import ScenarioTable

#: Rate of the camera [Hz].
CAMERA_RATE = 30.0
#: Steps of the simulator that is the model, as a new study gets them, and of cloth what it is by default [s]; a finer
#: one's are half as long.
TIME_STEPS = {"rope": 0.00125, "cloth": 0.005}
#: Which motions are fitted and which one, of another type, is held out; by what a case needs them for.
Roles = dict[str, tuple[tuple[str, ...], str]]


@dataclass(frozen=True)
class Setting:
    """One object in its surroundings.

    Args:
        thing: ``"rope"`` or ``"cloth"``.
        contact: whether it touches anything but its grippers.
        scenario: the built-in one that it starts from.
        size: of the object [m].
        counts: vertices along it, of the model.
        grasps: vertices that each gripper holds.
        markers: vertices under the markers, where all are given.
        motions: by name.
        roles: by name; ``"a"`` and ``"b"`` shake the object well, the others do not.
        effects: of the library that may show here.
        parameters: to infer; none: what the scenario has.
        obstacles: what stands around it; None: what the scenario has.
    """

    thing: str
    contact: bool
    scenario: str
    size: tuple[float, ...]
    counts: tuple[int, ...]
    grasps: tuple[tuple[int, ...], ...]
    markers: tuple[int, ...]
    motions: dict[str, Callable[[], Motion]]
    roles: Roles
    effects: tuple[str, ...]
    parameters: dict[str, ParameterTable] = field(default_factory=dict)
    obstacles: tuple[dict[str, Any], ...] | None = None

    def table(self, *, fine: bool = False, markers: int | None = None) -> ScenarioTable:
        """``[scenario]`` of the model, or of a mesh twice as fine with markers at the same places.

        Args:
            fine: a mesh with a vertex between every two of the model's.
            markers: how many are used, spread evenly; None: all.
        """
        chosen = self.markers
        if markers is not None:
            chosen = tuple(chosen[k] for k in np.linspace(0, len(chosen) - 1, markers).round().astype(int))
        counts = tuple(2 * n - 1 for n in self.counts) if fine else self.counts
        finer = self._finer if fine else int
        grasps = [[finer(v) for v in held] for held in self.grasps]
        if fine and self.thing == "rope":  # the piece that is held, not only its ends
            grasps = [list(range(min(held), max(held) + 1)) for held in grasps]
        table: dict[str, Any] = {
            "name": self.scenario,
            "size": list(self.size),
            "vertices": list(counts),
            "grasps": grasps,
            "markers": [finer(v) for v in chosen],
        }
        if self.obstacles is not None:
            table["obstacles"] = [dict(o) for o in self.obstacles]
        return ScenarioTable.model_validate(table)

    def _finer(self, vertex: int) -> int:
        """The number that a vertex of the model has in the finer mesh."""
        if self.thing == "rope":
            return 2 * vertex
        row, column = divmod(vertex, self.counts[0])
        return 2 * row * (2 * self.counts[0] - 1) + 2 * column


def frames(motion: Motion, still: float = 1.5) -> FloatArray:
    """When a motion is seen ``(T,)`` [s]."""
    return np.arange(0.0, (motion.times[-1] or still) + 1e-9, 1.0 / CAMERA_RATE)


def _both_ends(apart: float, first: FloatArray, second: FloatArray, roll: FloatArray, times: FloatArray) -> Motion:
    """Two grippers ``apart`` [m] along x, displaced by ``(T, 3)`` [m]; the second turns by ``roll (T,)`` [rad]."""
    poses = np.zeros((len(times), 2, 7))
    poses[..., 3] = 1.0
    poses[:, 0, :3] = np.array([0.0, 0.0, 1.0]) + first
    poses[:, 1, :3] = np.array([apart, 0.0, 1.0]) + second
    poses[:, 1, 3], poses[:, 1, 4] = np.cos(roll / 2), np.sin(roll / 2)
    return Motion(times, poses)


def _eased(share: FloatArray) -> FloatArray:
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s**3 * (10 - 15 * s + 6 * s**2))


def _cable(kind: str) -> Motion:
    times = np.arange(0.0, 1.8 + 0.005, 0.01)
    grow, zero = _eased(times / 0.4), np.zeros_like(times)
    there = _eased(times / 0.8) - _eased((times - 0.9) / 0.8)
    first, second, roll = np.zeros((len(times), 3)), np.zeros((len(times), 3)), zero
    if kind == "across":
        first[:, 1] = 0.07 * grow * np.sin(2 * np.pi * 1.1 * times)
        second[:, 1] = -0.05 * grow * np.sin(2 * np.pi * 1.4 * times)
        second[:, 0] = -0.1 * there
    elif kind == "heave":
        second[:, 2], second[:, 0] = 0.15 * there, -0.05 * there
        first[:, 2] = 0.04 * grow * np.sin(2 * np.pi * 1.6 * times)
        roll = -1.5 * there
    elif kind == "roll":
        roll, second[:, 0] = 3.0 * _eased(times / 1.2), -0.12 * _eased(times / 1.2)
        second[:, 1] = 0.05 * there
    else:  # slow: one end goes a little way once
        second[:, 1] = 0.03 * _eased(times / 1.6)
    return _both_ends(0.56, first, second, roll, times)


def _slow(y: float, z: float = 0.0, height: float = 1.0) -> Callable[[], Motion]:
    return lambda: smooth_path([(0, 0, 0, height), (1.4, 0, y, height + z)], 0.2)


def _at(height: float) -> Callable[[], Motion]:
    return lambda: smooth_path([(0, 0, 0, height), (1.5, 0, 0, height)])


def _path(*knots: tuple[float, float, float, float], tail: float = 0.3) -> Callable[[], Motion]:
    return lambda: smooth_path(list(knots), tail)


_IN_THE_AIR: dict[str, Callable[[], Motion]] = {
    "fling": lambda: fling_motion(tail=0.5),
    "swing": lambda: swing_motion(0.1, 1.1, 2.0),
    "carry": _path((0, 0, 0, 1.0), (0.6, 0.25, 0.15, 1.1), (1.3, -0.1, 0.3, 0.95), tail=0.4),
    "still": _at(1.0),
    "slow": _slow(0.08),
    "slow-back": _slow(-0.06, 0.02),
}
_FREE: Roles = {
    "a": (("fling", "swing"), "carry"),
    "b": (("carry", "fling"), "swing"),
    "slow": (("slow",), "slow-back"),
    "still": (("still",), "slow"),
}
_CAMERA = ("camera-latency", "camera-offset", "camera-rotation")
_HANDS = ("actuator-lag", "grasp-compliance", "grasp-slip")
_GRID = tuple(9 * row + column for row in range(0, 9, 2) for column in range(0, 9, 2))
_FRICTION = ParameterTable(low=0.1, high=1.0)

SETTINGS: dict[str, Setting] = {
    "rope-air": Setting(
        thing="rope",
        contact=False,
        scenario="swing",
        size=(0.6,),
        counts=(16,),
        grasps=((0, 1),),
        markers=tuple(range(16)),
        motions=_IN_THE_AIR,
        roles=_FREE,
        effects=(
            *("cylinder-drag", "wind", "viscous-damping", "internal-damping", "rope-hysteresis", "strain-stiffening"),
            *("wet-patch", "gravity-tilt", "crease", *_HANDS, *_CAMERA),
        ),
    ),
    "rope-cable": Setting(
        thing="rope",
        contact=False,
        scenario="cable",
        size=(0.8,),
        counts=(20,),
        grasps=((0, 1), (18, 19)),
        markers=tuple(range(20)),
        motions={k: (lambda k=k: _cable(k)) for k in ("across", "heave", "roll", "slow")} | {"still": lambda: _held()},
        roles={
            "a": (("across", "roll"), "heave"),
            "b": (("heave", "across"), "roll"),
            "slow": (("slow",), "still"),
            "still": (("still",), "slow"),
        },
        effects=(
            *("cylinder-drag", "wind", "viscous-damping", "internal-damping", "rope-hysteresis", "twist-stiffness"),
            *("uneven-rigidity", "gravity-tilt", "wet-patch", "crease", *_HANDS, *_CAMERA),
        ),
    ),
    "rope-table": Setting(
        thing="rope",
        contact=True,
        scenario="swing",
        size=(0.6,),
        counts=(16,),
        grasps=((0, 1),),
        markers=tuple(range(16)),
        motions={
            # laid down while it trails: lowered straight, a rope buckles by chance
            "drag": _path((0, 0, 0, 0.63), (0.5, 0, 0.35, 0.5), (1.4, 0.1, 0.75, 0.3)),
            "dip": _path((0, 0, 0, 0.63), (0.5, 0.3, 0.1, 0.55), (1.0, 0.5, 0.25, 0.4), (1.5, 0.4, 0.1, 0.6)),
            "sweep": _path((0, 0, 0, 0.63), (0.4, 0.25, 0, 0.55), (0.9, 0.35, 0.3, 0.4), (1.5, 0, 0.4, 0.4)),
            "still": _at(0.63),
            "slow": _slow(0.06, 0.0, 0.63),
        },
        roles={
            "a": (("drag", "dip"), "sweep"),
            "b": (("sweep", "drag"), "dip"),
            "slow": (("slow",), "still"),
            "still": (("still",), "slow"),
        },
        effects=(
            *("capstan-friction", "stick-slip", "adhesion", "table-tilt", "viscous-damping", "cylinder-drag"),
            *("rope-hysteresis", "gravity-tilt", *_HANDS, *_CAMERA),
        ),
        obstacles=({"kind": "table", "height": 0.0},),
    ),
    "cloth-air": Setting(
        thing="cloth",
        contact=False,
        scenario="fling",
        size=(0.3, 0.3),
        counts=(9, 9),
        grasps=((0, 8),),
        markers=_GRID,
        motions=_IN_THE_AIR,
        roles=_FREE,
        effects=(
            *("air-drag", "wind", "added-mass", "viscous-damping", "internal-damping", "bending-hysteresis"),
            *("anisotropy", "strain-stiffening", "hem", "wet-patch", "gravity-tilt", "crease", *_HANDS, *_CAMERA),
        ),
    ),
    "cloth-table": Setting(
        thing="cloth",
        contact=True,
        scenario="fold",
        size=(0.3, 0.3),
        counts=(9, 9),
        grasps=((0, 8),),
        markers=_GRID,
        motions={
            "wipe": _path((0, 0, 0, 0.001), (0.7, 0.02, 0.15, 0.001), (1.3, 0.12, 0.12, 0.001), tail=0.2),
            "peel": _path((0, 0, 0, 0.001), (0.6, 0, -0.1, 0.2), (1.3, 0.03, 0.08, 0.02), tail=0.3),
            "fold": _path((0, 0, 0, 0.001), (0.6, 0, -0.12, 0.15), (1.2, 0, -0.25, 0.02), tail=0.4),
            "still": _at(0.001),
            "slow": _slow(0.02, 0.0, 0.001),
        },
        roles={
            "a": (("wipe", "peel"), "fold"),
            "b": (("fold", "wipe"), "peel"),
            "slow": (("slow",), "still"),
            "still": (("still",), "slow"),
        },
        effects=(
            *("anisotropic-friction", "stick-slip", "adhesion", "table-tilt", "air-drag", "viscous-damping"),
            *("bending-hysteresis", "added-mass", "hem", "gravity-tilt", "crease", *_HANDS, *_CAMERA),
        ),
        parameters={
            "stretch_stiffness": ParameterTable(low=30.0, high=3000.0, scale="log"),
            "bending_rigidity": ParameterTable(low=2e-6, high=5e-4, scale="log"),
            "friction": _FRICTION,
        },
    ),
}


def _held() -> Motion:
    times = np.array([0.0, 1.5])
    return _both_ends(0.56, np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(2), times)
