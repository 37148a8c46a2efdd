"""Falling: freely, and through air."""

from functools import partial

import numpy as np

from ..arrays import FloatArray
from ..body import Body, rope_line, solid_box
from ..material import MATERIALS, ClothMaterial
from ..registry import REGISTRY
from ..scenario import STANDARD_GRAVITY
from ..scene import Scene
from ..simulator import State
from .case import GOALS, Asked, Case, VirtualTest
from .lab import Lab
from .meshes import strip

#: Density of air at 20 degrees C and 101 325 Pa [kg/m3].
AIR_DENSITY = 1.204
_DROP = 0.4
_DRAG = 1.2
_DOWN = np.array([0.0, 0.0, -STANDARD_GRAVITY])


def _object(kind: str, cells: int) -> Body:
    if kind == "cloth":
        return strip(0.0, 0.2, 0.2, (cells, cells))
    if kind == "rope":
        return rope_line(np.array([[0.0, 0, 0], [0.2, 0, 0]]), cells + 1)
    return solid_box(np.zeros(3), np.full(3, 0.05), (cells + 1, cells + 1, cells + 1))


def measure_free(lab: Lab, cells: int, kind: str) -> tuple[float]:
    """Height fallen in 0.4 s [m]: g t^2 / 2."""
    body = _object(kind, cells)
    scene = Scene(body, MATERIALS[kind](), _DOWN, (), np.zeros(len(body.vertices)))
    times, height = lab.watch(scene, _DROP, lambda state: state.positions[:, 2].mean())
    return (float(np.interp(_DROP, times, height[0] - height)),)


def terminal_velocity(areal_density: float) -> float:
    """sqrt(2 m g / (rho C_D A)) [m/s] of a level sheet."""
    return float(np.sqrt(2 * areal_density * STANDARD_GRAVITY / (AIR_DENSITY * _DRAG)))


def measure_in_air(lab: Lab, cells: int, areal_density: float) -> tuple[float, float]:
    """Speed [m/s] at rest with the air, and height [m] fallen on the way there.

    With v = :func:`terminal_velocity` the speed is v tanh(g t / v), the height v^2 / g ln cosh(g t / v). The height
    is taken after two times v / g, the speed after four, where tanh is 0.9993.
    """
    material = ClothMaterial(areal_density=areal_density)
    body = _object("cloth", cells)
    scene = Scene(body, material, _DOWN, (), np.zeros(len(body.vertices)))
    masses = body.vertex_measures * areal_density
    force = REGISTRY.get("effect", "air-drag")(drag_coefficient=_DRAG).bind(scene, masses)

    def push(time: float, state: State, masses: FloatArray) -> FloatArray:
        return np.asarray(force(time, state))

    def look(state: State) -> FloatArray:
        return np.array([state.positions[:, 2].mean(), state.velocities[:, 2].mean()])

    early = 2 * terminal_velocity(areal_density) / STANDARD_GRAVITY
    times, seen = lab.watch(scene, 2 * early, look, push)
    return -float(np.interp(2 * early, times, seen[:, 1])), float(np.interp(early, times, seen[0, 0] - seen[:, 0]))


def free_cases(quick: bool) -> tuple[Case, ...]:
    """Every kind of body once."""
    height = 0.5 * STANDARD_GRAVITY * _DROP**2
    asked = (Asked("height", "m", height, GOALS["fall"]),)
    return tuple(Case(k, "0.4 s", asked, (4,), partial(measure_free, kind=k)) for k in ("cloth", "rope", "solid"))


def air_cases(quick: bool) -> tuple[Case, ...]:
    """A light and a heavy sheet."""
    out = []
    for density in (0.15,) if quick else (0.1, 0.3):
        speed = terminal_velocity(density)
        asked = (
            Asked("speed", "m/s", speed * float(np.tanh(4.0)), GOALS["fall"]),
            Asked("height", "m", speed**2 / STANDARD_GRAVITY * float(np.log(np.cosh(2.0))), GOALS["fall"]),
        )
        meshes = (4,) if quick else (4, 8)
        out.append(Case("cloth", f"{density:g} kg/m2", asked, meshes, partial(measure_in_air, areal_density=density)))
    return tuple(out)


FREE = VirtualTest("free-fall", "fall", "along the object", free_cases)
AIR = VirtualTest("terminal-velocity", "fall", "along the sheet", air_cases)
