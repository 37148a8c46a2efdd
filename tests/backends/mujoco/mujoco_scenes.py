"""Scenes and runs shared by the tests of this backend."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from muslin.backends.mujoco import MujocoSimulator
from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.material import ClothMaterial, Material, RopeMaterial, SolidMaterial
from muslin.core.scene import Scene
from muslin.core.simulator import World

G = 9.80665
DOWN = np.array([0.0, 0.0, -G])
NONE_HELD = np.zeros(0, dtype=np.int64)
NOWHERE = np.zeros((0, 3))
SMALL_CLOTH = cloth_grid(0.2, 0.2, 4, 4)
SMALL_SOLID = solid_box(np.zeros(3), np.array([0.04, 0.03, 0.03]), (3, 3, 3))

SMALL_ROPE = rope_line(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]), 6)
OBJECTS: dict[str, tuple[Body, Material]] = {
    "cloth": (SMALL_CLOTH, ClothMaterial()),
    "rope": (SMALL_ROPE, RopeMaterial()),
    "solid": (SMALL_SOLID, SolidMaterial()),
}

#: Sag over length of a heavy elastica (a clamped strip that hangs over freely) with w L^3 / B = 7.35, where w is the
#: weight per length and B the bending rigidity: from its boundary value problem.
HEAVY_ELASTICA, HEAVY_SAG = 7.35, 0.616

# The beam of the demo: 0.1 x 0.03 x 0.03 m of silicone.
E, NU, L, H, RHO = 264e3, 0.3, 0.1, 0.03, 1070.0
AREA, INERTIA, SHEAR = H * H, H**4 / 12, E / 2 / (1 + NU)


def scene(body: Body, material: Material, **changes: Any) -> Scene:
    held = changes.pop("held", NONE_HELD)
    given = {"gravity": DOWN, "grasps": (held,), "loads": np.zeros(len(body.vertices)), **changes}
    return Scene(body, material, **given)


@contextmanager
def opened(what: Scene, **options: Any) -> Iterator[World]:
    simulator = MujocoSimulator(**options)
    simulator.check(what)
    world = simulator.open(what)
    try:
        yield world
    finally:
        world.close()


def run(world: World, seconds: float, held: Any = NOWHERE, forces: Any = None, brake: float = 0.0) -> np.ndarray:
    """Step with constant commands; ``brake`` [1/s] slows every vertex down."""
    for _ in range(round(seconds / world.time_step)):
        total = forces
        if brake:
            total = -brake * world.masses[:, None] * world.state().velocities + (0.0 if forces is None else forces)
        world.step(held, total)
    return world.state().positions


def strip(cells: int, width: float, length: float = 0.1) -> Body:
    """A level strip along x, square cells, with one more cell behind x = 0 to be held there."""
    cell = length / cells
    columns = round(width / cell) + 1
    sheet = cloth_grid((columns - 1) * cell, length + cell, columns, cells + 2)
    x, y = -sheet.vertices[:, 2] - cell, sheet.vertices[:, 0]
    return Body("cloth", np.stack([x, y, 0 * x], axis=1), sheet.elements, sheet.grid, sheet.warp)


def along_warp(body: Body, direction: Any) -> Body:
    """The same mesh with its warp along ``direction`` at rest."""
    corners = body.vertices[body.elements]
    edges = corners[:, 1:] - corners[:, :1]
    shares = np.einsum("xei,x->ei", np.linalg.pinv(edges).transpose(1, 0, 2), np.asarray(direction, float))
    return replace(body, warp=shares)


def droop(body: Body, material: Material, length: float = 0.1, gravity: float = G, seconds: float = 3.0) -> float:
    """Mean sag of the end at x = ``length`` over ``length`` after the part behind x = 0 was clamped level."""
    held = np.flatnonzero(body.vertices[:, 0] < 1e-9)
    tip = np.flatnonzero(body.vertices[:, 0] > length - 1e-9)
    with opened(scene(body, material, held=held, gravity=np.array([0.0, 0.0, -gravity]))) as world:
        return float(-run(world, seconds, body.vertices[held], brake=8.0)[tip, 2].mean() / length)


def beam_sag(
    seconds: float,
    load: float = 0.0,
    gravity: float = G,
    damping_time: float = 0.0,
    time_step: float = 0.005,
    counts: tuple[int, int, int] = (7, 3, 3),
) -> np.ndarray:
    """How far the tip of the clamped beam, let go at time zero, hangs down after every step [m]."""
    body = solid_box(np.zeros(3), np.array([L, H, H]), counts)
    x = body.vertices[:, 0]
    held, tip = np.flatnonzero(x < 1e-9), np.flatnonzero(x > L - 1e-9)
    loads = np.zeros(len(x))
    loads[tip] = load / len(tip)
    material = SolidMaterial(RHO, E, NU, damping_time)
    down = np.array([0.0, 0.0, -gravity])
    sag = []
    with opened(scene(body, material, held=held, loads=loads, gravity=down), time_step=time_step) as world:
        for _ in range(round(seconds / time_step)):
            world.step(body.vertices[held], None)
            sag.append(-(world.state().positions - body.vertices)[tip, 2].mean())
    return np.array(sag)


def timoshenko(load: float) -> float:
    """Sag of the tip under the beam's weight and a load at the tip [m], bending and shear."""
    bend, shear = 1 / (E * INERTIA), 1 / (5 / 6 * SHEAR * AREA)
    own = RHO * AREA * G
    return own * L**4 * bend / 8 + own * L**2 * shear / 2 + load * G * (L**3 * bend / 3 + L * shear)


def swing(time_step: float, path: np.ndarray) -> tuple[float, float]:
    """Angular frequency [rad/s] and rate of decay [1/s] of a sampled damped oscillation about any level."""
    turn = np.flatnonzero(np.diff(path[:-1]) * np.diff(path[1:]) < 0) + 1
    a, b, c = path[turn - 1], path[turn], path[turn + 1]  # a parabola through the samples at each turning point
    offset = 0.5 * (a - c) / (a - 2 * b + c)
    when, what = time_step * (turn + offset), b - 0.25 * (a - c) * offset
    rate = -np.polyfit(0.5 * (when[1:] + when[:-1]), np.log(np.abs(np.diff(what))), 1)[0]
    return float(np.pi / np.median(np.diff(when))), float(rate)
