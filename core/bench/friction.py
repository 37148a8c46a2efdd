"""The incline: an object on a table under tilted gravity."""

from functools import partial

import numpy as np

from ..arrays import FloatArray
from ..body import Body, rope_line, solid_box
from ..material import ClothMaterial, Material, RopeMaterial, SolidMaterial
from ..obstacles import Table
from ..scenario import STANDARD_GRAVITY
from ..scene import Scene
from ..simulator import State
from .case import GOALS, Asked, Case, VirtualTest
from .lab import Lab
from .meshes import strip

#: tan(angle) over mu, of the incline on which it slides and of that on which it sticks.
SLIDES, STICKS = 2.0, 0.7
#: Creep that still counts as sticking [mm/s].
MOST_CREEP = 1.0
_SIZE = 0.1


def _object(kind: str, friction: float, cells: int) -> tuple[Body, Material]:
    """A sheet, a rope along the slope or a flat block that lies on the table at height zero."""
    if kind == "cloth":
        return strip(0.0, _SIZE, _SIZE, (cells, cells)), ClothMaterial(friction=friction)
    if kind == "rope":
        rope = RopeMaterial(friction=friction)
        height = rope.diameter / 2
        return rope_line(np.array([[0.0, 0, height], [_SIZE, 0, height]]), cells + 1), rope
    high = np.array([_SIZE, _SIZE, 0.25 * _SIZE])
    return solid_box(np.zeros(3), high, (cells + 1, cells + 1, cells // 2 + 1)), SolidMaterial(friction=friction)


def _slide(lab: Lab, kind: str, cells: int, friction: float, slope: float, seconds: float) -> tuple[FloatArray, ...]:
    """Times, mean place and mean velocity along an incline of tan(angle) = ``slope``."""
    body, material = _object(kind, friction, cells)
    gravity = STANDARD_GRAVITY * np.array([slope, 0.0, -1.0]) / np.hypot(slope, 1.0)
    scene = Scene(body, material, gravity, (), np.zeros(len(body.vertices)), (Table(0.0),))
    share = body.vertex_measures / body.vertex_measures.sum()

    def look(state: State) -> FloatArray:
        return np.array([share @ state.positions[:, 0], share @ state.velocities[:, 0]])

    times, seen = lab.watch(scene, seconds, look)
    return times, seen[:, 0], seen[:, 1]


def measure_sliding(lab: Lab, cells: int, kind: str, friction: float) -> tuple[float]:
    """mu = tan(angle) - a / (g cos(angle)), a from the velocity between 0.1 and 0.4 s (Coulomb)."""
    slope = SLIDES * friction
    times, _, speed = _slide(lab, kind, cells, friction, slope, 0.4)
    late = times > 0.1
    acceleration = float(np.polyfit(times[late], speed[late], 1)[0])
    return (slope - acceleration * float(np.hypot(slope, 1.0)) / STANDARD_GRAVITY,)


def measure_creep(lab: Lab, cells: int, kind: str, friction: float) -> tuple[float]:
    """Speed [mm/s] between 0.5 and 1 s on a slope that should hold it."""
    times, place, _ = _slide(lab, kind, cells, friction, STICKS * friction, 1.0)
    late = times > 0.5
    return (1e3 * float(np.polyfit(times[late], place[late], 1)[0]),)


def cases(quick: bool) -> tuple[Case, ...]:
    """Coefficients of 0.1 to 0.9."""
    out = []
    for kind in ("cloth", "rope", "solid"):
        meshes = (4,) if quick or kind == "solid" else (4, 8)
        for mu in (0.3,) if quick else (0.1, 0.3, 0.6, 0.9):
            slides, creeps = (
                partial(measure_sliding, kind=kind, friction=mu),
                partial(measure_creep, kind=kind, friction=mu),
            )
            out.append(Case(kind, f"slides, mu {mu:g}", (Asked("mu", "1", mu, GOALS["friction"]),), meshes, slides))
            out.append(Case(kind, f"sticks, mu {mu:g}", (Asked("creep", "mm/s", 0.0, MOST_CREEP),), meshes, creeps))
    return tuple(out)


TEST = VirtualTest("incline", "friction", "along the object", cases)
