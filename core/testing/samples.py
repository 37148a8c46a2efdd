"""Small objects that the kits try plugins on: a soft sheet and a soft block."""

from dataclasses import replace

import numpy as np

from ..arrays import FloatArray, IntArray
from ..body import Body, cloth_grid, rope_line, solid_box
from ..kept_bend import KeptBend
from ..material import ClothMaterial, Material, RopeMaterial, SolidMaterial, with_fields
from ..motion import Motion
from ..obstacles import Obstacle
from ..scenario import STANDARD_GRAVITY, Scenario
from ..scene import Scene

KINDS = ("cloth", "rope", "solid")


def sample_body(kind: str) -> Body:
    """A sheet of 12 x 9 cm, a line of 15 cm or a block of 6 x 6 x 6 cm, tilted so that no axis is special."""
    if kind == "cloth":
        body = cloth_grid(0.12, 0.09, 4, 3)
    elif kind == "rope":
        body = rope_line(np.array([[0.0, 0.0, 0.0], [0.09, 0.12, 0.0]]), 6)
    else:
        body = solid_box(np.zeros(3), np.full(3, 0.06), (3, 3, 3))
    return tilted(body)


def tilted(body: Body) -> Body:
    """``body`` turned by 0.3 rad about x, and lifted by 1 m."""
    cos, sin = np.cos(0.3), np.sin(0.3)
    tilt = np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]])
    return replace(body, vertices=body.vertices @ tilt.T + np.array([0.0, 0.0, 1.0]))


def sample_material(kind: str) -> Material:
    """Soft, so that explicit engines stay stable at ordinary steps."""
    if kind == "cloth":
        return ClothMaterial(areal_density=0.2, stretch_stiffness=60.0, bending_rigidity=1e-5)
    if kind == "rope":
        return RopeMaterial(linear_density=0.05, stretch_stiffness=20.0, bending_rigidity=2e-5, twist_rigidity=2e-5)
    return SolidMaterial(density=1000.0, youngs_modulus=3e4)


def sample_grasp(body: Body) -> IntArray:
    """The two top corners of the sheet, the first vertex of the line, the lowest face along y of the block."""
    if body.kind == "cloth":
        return np.array([0, 3], np.int64)
    if body.kind == "rope":
        return np.array([0], np.int64)
    return np.arange(0, 27).reshape(3, 3, 3)[:, 0].ravel().astype(np.int64)


def sample_scene(
    kind: str,
    *,
    held: bool = False,
    gravity: FloatArray | None = None,
    obstacles: tuple[Obstacle, ...] = (),
    load: float = 0.0,
    **fields: float,
) -> Scene:
    """A scene at rest.

    Args:
        kind: of :data:`KINDS`.
        held: hold :func:`sample_grasp`.
        gravity: ``(3,)`` [m/s2]; default straight down.
        obstacles: what stands around it.
        load: mass hung on the last vertex [kg].
        fields: of the material.
    """
    body = sample_body(kind)
    loads = np.zeros(len(body.vertices))
    loads[-1] = load
    down = np.array([0.0, 0.0, -STANDARD_GRAVITY]) if gravity is None else gravity
    grasps = (sample_grasp(body),) if held else ()
    return Scene(body, with_fields(sample_material(kind), fields), down, grasps, loads, obstacles)


def sample_scenario(kind: str, duration: float = 0.3, obstacles: tuple[Obstacle, ...] = ()) -> Scenario:
    """The held object carried to and fro for ``duration`` [s], every vertex a marker."""
    body = sample_body(kind)
    clock = np.linspace(0.0, duration, 31)
    phase = np.pi * clock / duration
    path = np.stack([0.03 * np.sin(phase) ** 2, 0.08 * np.sin(phase) ** 2, 0.0 * clock], axis=1)
    return Scenario(
        name=f"conformance {kind}",
        body=body,
        grasps=(sample_grasp(body),),
        motion=Motion.from_positions(clock, path[:, None]),
        times=np.linspace(0.0, duration, 16),
        markers=np.eye(len(body.vertices)),
        load_vertices=np.zeros(0, np.int64),
        obstacles=obstacles,
        kept=_sample_bend(len(body.vertices)) if kind == "rope" else None,
    )


def _sample_bend(count: int) -> KeptBend:
    """Of a rope that is bent to a radius of 0.5 m where nothing acts on it, whatever it is made of."""
    inner = count - 2
    shapes = np.eye(inner)[:, :, None] * np.array([0.0, 2.0])
    nothing = np.zeros((inner, 2))
    along = np.arange(1, count - 1) / (count - 1)
    return KeptBend(shapes, 0.0 * shapes, np.zeros((2, 4, *nothing.shape)), nothing, along, along)
