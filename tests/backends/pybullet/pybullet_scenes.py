"""Scenes and runs shared by the tests of this backend."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from muslin.backends.pybullet import PybulletSimulator
from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.material import Material
from muslin.core.scene import Scene
from muslin.core.simulator import World

GRAVITY = np.array([0.0, 0.0, -9.80665])
WEIGHTLESS = np.zeros(3)
NONE_HELD = np.zeros(0, dtype=np.int64)
NOWHERE = np.zeros((0, 3))


def scene(body: Body, material: Material, **changes: Any) -> Scene:
    held = changes.pop("held", NONE_HELD)
    given = {"gravity": GRAVITY, "grasps": (held,), "loads": np.zeros(len(body.vertices)), **changes}
    return Scene(body, material, **given)


@contextmanager
def opened(what: Scene, **options: Any) -> Iterator[World]:
    simulator = PybulletSimulator(**options)
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


def flat(body: Body, height: float = 0.0) -> Body:
    """The same sheet lying in the x-y plane, its row 0 at y = 0 and the others at negative y."""
    x, _, z = body.vertices.T
    return Body(body.kind, np.stack([x, z, np.full_like(x, height)], axis=1), body.elements, body.grid)


SMALL_CLOTH = cloth_grid(0.2, 0.2, 5, 5)
SMALL_ROPE = rope_line(np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0]]), 9)
SMALL_SOLID = solid_box(np.zeros(3), np.array([0.04, 0.03, 0.03]), (4, 3, 3))
