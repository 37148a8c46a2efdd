"""Triangles to draw: the visible surface of an object, and of what stands around it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray, IntArray
from .body import Body
from .errors import InputError
from .obstacles import Cylinder, StaticMesh
from .scene import Scene

#: Sides of a drawn rope, and of a drawn cylinder.
ROPE_SIDES, CYLINDER_SIDES = 12, 64


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh whose points move while its triangles and texture stay.

    Args:
        triangles: ``(F, 3)`` between the points, outward; seen from that side only.
        uv: where on the texture every point is ``(N, 2)``: u right, v down, 0 to 1.
        weld: ``(N,)``; points of the same number share one normal, so that the light runs smoothly over them.
        place: points ``(N, 3)`` [m] from the vertices ``(V, 3)`` [m] of the object.
    """

    triangles: IntArray
    uv: FloatArray
    weld: IntArray
    place: Callable[[FloatArray], FloatArray]

    def normals(self, points: FloatArray) -> FloatArray:
        """Unit normals ``(N, 3)``, averaged over the triangles around a point by area."""
        corners = points[self.triangles]
        area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        where = self.weld[self.triangles].ravel()
        each = np.repeat(area, 3, axis=0)
        sums = np.stack([np.bincount(where, each[:, k], minlength=len(points)) for k in range(3)], axis=1)
        length = np.linalg.norm(sums, axis=1, keepdims=True)
        return np.asarray((sums / np.where(length > 0, length, 1.0))[self.weld])


def object_surface(scene: Scene) -> Surface:
    """What is seen of the scene's object: a sheet from both sides, a rope as a tube, the skin of a solid."""
    body = scene.body
    if body.kind == "rope":
        return _tube(body, scene.contact_radius)
    triangles, count = body.triangles, len(body.vertices)
    uv = texture_coordinates(body)
    if body.kind == "solid":
        return Surface(triangles, uv, np.arange(count), lambda vertices: vertices)
    both = np.concatenate([triangles, triangles[:, ::-1] + count])
    return Surface(both, np.tile(uv, (2, 1)), np.arange(2 * count), lambda vertices: np.tile(vertices, (2, 1)))


def texture_coordinates(body: Body) -> FloatArray:
    """``(V, 2)``: a picture laid over the rest shape, u right and v down, 0 to 1.

    On a sheet with a grid u runs with the columns and v with the rows. Any other mesh is looked at
    along its shortest axis, from -x, -y or above; v then runs against a sheet's warp, or down the z axis.
    """
    if body.kind == "cloth" and body.grid is not None:
        rows, columns = body.grid
        v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
        return np.stack([u.ravel(), v.ravel()], axis=1)
    apart = body.vertices - body.vertices.mean(axis=0)
    normal = np.linalg.svd(apart, full_matrices=False)[2][2]
    main = int(np.argmax(np.abs(normal)))
    normal = normal * np.sign(normal[main]) * (1.0 if main == 2 else -1.0)
    down = -body.warp_directions(body.vertices).mean(axis=0) if body.kind == "cloth" else np.array([0.0, 0.0, -1.0])
    down = down - (down @ normal) * normal
    if np.linalg.norm(down) < 0.1:  # it looks along that axis, or the warp has no common direction
        down = np.linalg.svd(apart, full_matrices=False)[2][1]
    down = down / np.linalg.norm(down)
    flat = apart @ np.stack([np.cross(normal, down), down], axis=1)
    span = np.ptp(flat, axis=0)
    return np.asarray((flat - flat.min(axis=0)) / np.where(span > 0, span, 1.0))


def _tube(body: Body, radius: float) -> Surface:
    """A tube around the chain, closed at its ends; u runs around it and v along it."""
    count, ring = len(body.vertices), ROPE_SIDES + 1  # the first point of a ring twice, for the seam of the texture
    angle = np.arange(ring) * 2 * np.pi / ROPE_SIDES
    # a polygon of the circle's area: on average it hides as much as the circle
    radius = radius * np.sqrt(np.pi / (0.5 * ROPE_SIDES * np.sin(2 * np.pi / ROPE_SIDES)))
    circle = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    a = (np.arange(count - 1)[:, None] * ring + np.arange(ROPE_SIDES)).ravel()
    wall = np.concatenate([np.stack([a, a + 1, a + ring], 1), np.stack([a + 1, a + 1 + ring, a + ring], 1)])
    ends = count * ring + np.array([0, ring + 1])  # of each cap the centre, then its ring
    k = np.arange(ROPE_SIDES)
    first = np.stack([np.full(ROPE_SIDES, ends[0]), ends[0] + 2 + k, ends[0] + 1 + k], axis=1)
    last = np.stack([np.full(ROPE_SIDES, ends[1]), ends[1] + 1 + k, ends[1] + 2 + k], axis=1)
    along = np.concatenate([[0.0], np.cumsum(body.measures)]) / max(body.measures.sum(), 1e-12)
    uv = np.stack(np.meshgrid(np.linspace(0, 1, ring), along), axis=-1).reshape(-1, 2)
    uv = np.concatenate([uv, np.tile([0.5, 0.0], (ring + 1, 1)), np.tile([0.5, 1.0], (ring + 1, 1))])
    weld = np.arange(len(uv))
    weld[ROPE_SIDES : count * ring : ring] = weld[0 : count * ring : ring]

    def place(vertices: FloatArray) -> FloatArray:
        across, up = _frames(vertices)
        rings = vertices[:, None] + circle[:, :1] * across[:, None] + circle[:, 1:] * up[:, None]
        caps = [vertices[:1], rings[0], vertices[-1:], rings[-1]]
        return np.concatenate([rings.reshape(-1, 3), *caps])

    return Surface(np.concatenate([wall, first, last]), uv, weld, place)


def _frames(vertices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors ``(V, 3)`` across a chain at every vertex, carried along it without twist.

    Each frame is the one before, turned by the least rotation that takes one tangent into the next.
    """
    step = np.diff(vertices, axis=0)
    length = np.linalg.norm(step, axis=1, keepdims=True)
    unit = step / np.where(length > 0, length, 1.0)
    tangent = np.concatenate([unit[:1], unit[:-1] + unit[1:], unit[-1:]])
    size = np.linalg.norm(tangent, axis=1, keepdims=True)
    tangent = np.where(size > 1e-9, tangent / np.where(size > 1e-9, size, 1.0), [1.0, 0.0, 0.0])
    across = np.empty_like(tangent)
    start = np.eye(3)[np.argmin(np.abs(tangent[0]))]
    for k, t in enumerate(tangent):
        if k:
            s = tangent[k - 1]
            start = across[k - 1] - (across[k - 1] @ t) / max(1.0 + s @ t, 1e-9) * (s + t)
        start = start - (start @ t) * t
        across[k] = start / max(float(np.linalg.norm(start)), 1e-12)
    return across, np.cross(tangent, across)


def obstacle_surface(obstacle: Cylinder | StaticMesh) -> Surface:
    """A solid that does not move; ``place`` gives the same points whatever it is given."""
    if isinstance(obstacle, StaticMesh):
        # every triangle has corners of its own, so that edges look sharp
        points = obstacle.vertices[obstacle.triangles].reshape(-1, 3)
        triangles, weld = np.arange(len(points)).reshape(-1, 3), np.arange(len(points))
    elif isinstance(obstacle, Cylinder):
        points, triangles, weld = _cylinder(obstacle)
    else:
        raise InputError(f"a {type(obstacle).__name__} has no triangles to draw")
    return Surface(triangles, np.zeros((len(points), 2)), weld, lambda vertices: points)


def _cylinder(solid: Cylinder) -> tuple[FloatArray, IntArray, IntArray]:
    """Points, triangles and welds: the wall, then caps with points of their own, so that the rim looks sharp."""
    line = solid.center + np.array([[-0.5], [0.5]]) * solid.length * solid.direction
    across, up = _frames(line)
    angle = np.arange(CYLINDER_SIDES) * 2 * np.pi / CYLINDER_SIDES
    circle = solid.radius * (np.cos(angle)[:, None] * across[0] + np.sin(angle)[:, None] * up[0])
    n, k = CYLINDER_SIDES, np.arange(CYLINDER_SIDES)
    after = (k + 1) % n
    points = np.concatenate([line[0] + circle, line[1] + circle, line[0] + circle, line[1] + circle, line])
    triangles = np.concatenate(
        [
            np.stack([k, after, k + n], axis=1),
            np.stack([after, after + n, k + n], axis=1),
            np.stack([np.full(n, 4 * n), 2 * n + after, 2 * n + k], axis=1),
            np.stack([np.full(n, 4 * n + 1), 3 * n + k, 3 * n + after], axis=1),
        ]
    )
    return points, triangles, np.arange(len(points))
