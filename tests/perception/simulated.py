"""Simulated takes and their pictures, small and quick."""

import numpy as np

from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.camera import Camera
from muslin.core.frames import Frames
from muslin.core.material import ClothMaterial, Material, RopeMaterial, SolidMaterial
from muslin.core.obstacles import Obstacle
from muslin.core.scene import Scene
from muslin.core.series import PointSeries
from muslin.core.simulated_take import SimulatedTake

TIME = np.arange(4) / 10.0
_BODIES: dict[str, tuple[Body, Material]] = {
    "cloth": (cloth_grid(0.3, 0.3, 7, 7), ClothMaterial()),
    "rope": (rope_line(np.array([[-0.15, 0.0, -0.1], [0.15, 0.0, -0.2]]), 9), RopeMaterial(diameter=0.02)),
    "solid": (solid_box(np.full(3, -0.06), np.full(3, 0.06), (3, 3, 3)), SolidMaterial()),
}


def take(kind: str = "cloth", *obstacles: Obstacle, seen: bool = True, shift: float = 0.0) -> SimulatedTake:
    """An object that moves by 1 cm a frame to the right before a camera that looks along y; each vertex a marker."""
    body, material = _BODIES[kind]
    step = np.array([0.01, 0.0, 0.0])
    vertices = body.vertices + (np.arange(4)[:, None, None] + shift) * step
    scene = Scene(body, material, np.zeros(3), (), np.zeros(len(body.vertices)), obstacles)
    camera = Camera.look_at(np.array([0.05, -1.0, 0.1]), np.array([0.0, 0.0, -0.1]), width=160, height=120)
    return SimulatedTake(PointSeries(TIME, vertices), vertices, scene, camera if seen else None)


def pictures(kind: str = "cloth") -> Frames:
    """The take drawn, with depth and camera."""
    return take(kind).frames()
