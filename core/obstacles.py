"""What stands around the object: tables, spools and discs, and any closed mesh. None of it moves."""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from .arrays import FloatArray, IntArray
from .errors import InputError


@dataclass(frozen=True)
class Table:
    """Everything below a horizontal plane.

    Args:
        height: of the surface [m].
        friction: times the material's own is the Coulomb coefficient between both [1].
    """

    height: float
    friction: float = 1.0

    def __post_init__(self) -> None:
        _check("a table", self.friction, np.array([self.height]))

    @property
    def depth(self) -> float:
        """How deep a point can be inside [m]."""
        return float("inf")

    def signed_distance(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distance ``(P,)`` [m] of ``points (P, 3)``, negative inside, and the outward normals ``(P, 3)``."""
        return points[:, 2] - self.height, np.broadcast_to(np.array([0.0, 0.0, 1.0]), points.shape)


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A solid cylinder with flat ends: a spool, a rod, a disc.

    Args:
        center: of the solid ``(3,)`` [m].
        axis: direction ``(3,)`` of any length.
        radius: [m].
        length: along the axis [m].
        friction: times the material's own is the Coulomb coefficient between both [1].
    """

    center: FloatArray
    axis: FloatArray
    radius: float
    length: float
    friction: float = 1.0

    def __post_init__(self) -> None:
        _check("a cylinder", self.friction, self.center, self.axis)
        if not (self.radius > 0 and self.length > 0 and np.linalg.norm(self.axis) > 0):
            raise InputError(
                f"a cylinder needs a positive radius and length and an axis that is not zero, got radius "
                f"{self.radius:g} m, length {self.length:g} m, axis {list(self.axis)}"
            )

    @property
    def depth(self) -> float:
        """How deep a point can be inside [m]."""
        return min(self.radius, self.length / 2)

    @cached_property
    def direction(self) -> FloatArray:
        """The axis as a unit vector ``(3,)``."""
        return np.asarray(self.axis / np.linalg.norm(self.axis))

    def signed_distance(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distance ``(P,)`` [m] of ``points (P, 3)``, negative inside, and the outward normals ``(P, 3)``."""
        apart = points - self.center
        along = apart @ self.direction
        across = apart - along[:, None] * self.direction
        radial = np.linalg.norm(across, axis=1)
        outward = across / np.where(radial > 0, radial, 1.0)[:, None]
        ends = np.sign(along)[:, None] * self.direction
        wall, cap = radial - self.radius, np.abs(along) - self.length / 2
        beyond = np.hypot(np.maximum(wall, 0.0), np.maximum(cap, 0.0))
        distance = beyond + np.minimum(np.maximum(wall, cap), 0.0)
        rim = np.maximum(wall, 0.0)[:, None] * outward + np.maximum(cap, 0.0)[:, None] * ends
        inside = np.where((wall > cap)[:, None], outward, ends)
        normal = np.where((beyond > 0)[:, None], rim / np.where(beyond > 0, beyond, 1.0)[:, None], inside)
        return distance, normal


@dataclass(frozen=True, eq=False)
class StaticMesh:
    """A closed surface that does not move.

    Args:
        vertices: ``(N, 3)`` [m].
        triangles: ``(F, 3)``, outward.
        friction: times the material's own is the Coulomb coefficient between both [1].
    """

    vertices: FloatArray
    triangles: IntArray
    friction: float = 1.0

    def __post_init__(self) -> None:
        _check("a static mesh", self.friction, self.vertices)
        if not len(self.triangles) or self.triangles.min() < 0 or self.triangles.max() >= len(self.vertices):
            raise InputError(f"a static mesh needs triangles between its {len(self.vertices)} vertices")
        edges = np.sort(self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        _, uses = np.unique(edges, axis=0, return_counts=True)
        if (uses != 2).any():
            raise InputError(
                f"a static mesh must be closed, but {int((uses != 2).sum())} of its edges do not belong to exactly "
                "two triangles; close its holes first"
            )
        if self.volume < 0:
            raise InputError("the triangles of a static mesh must look outward; turn them around")

    @cached_property
    def depth(self) -> float:
        """How deep a point can be inside [m], at most: the radius of a ball of the same volume."""
        return float(np.cbrt(3.0 * self.volume / (4.0 * np.pi)))

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Low and high corner ``(3,)`` of the box around it [m]."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    @property
    def volume(self) -> float:
        """[m3], positive if the triangles look outward."""
        return float(np.linalg.det(self.vertices[self.triangles]).sum() / 6.0)

    def signed_distance(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distance ``(P,)`` [m] of ``points (P, 3)``, negative inside, and the outward normals ``(P, 3)``.

        By trying every triangle: meant for meshes of some hundred triangles. Inside is where the solid
        angles of the triangles add up to more than 2 pi (Van Oosterom and Strackee 1983).
        """
        corners = self.vertices[self.triangles]
        nearest = np.stack([_nearest_on_triangles(p, corners) for p in points])
        apart = points - nearest
        far = np.linalg.norm(apart, axis=1)
        a, b, c = (corners[None, :, k] - points[:, None] for k in range(3))
        la, lb, lc = (np.linalg.norm(e, axis=2) for e in (a, b, c))
        above = np.einsum("pfx,pfx->pf", a, np.cross(b, c))
        below = la * lb * lc + np.sum(a * b, 2) * lc + np.sum(b * c, 2) * la + np.sum(c * a, 2) * lb
        inside = 2.0 * np.arctan2(above, below).sum(axis=1) > 2.0 * np.pi
        sign = np.where(inside, -1.0, 1.0)
        return sign * far, sign[:, None] * apart / np.where(far > 0, far, 1.0)[:, None]


Obstacle: TypeAlias = Table | Cylinder | StaticMesh


def _nearest_on_triangles(point: FloatArray, corners: FloatArray) -> FloatArray:
    """The point ``(3,)`` of the triangles ``(F, 3, 3)`` nearest to ``point (3,)``."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    ap = point - a
    g11, g12, g22 = (np.sum(x * y, 1) for x, y in ((ab, ab), (ab, ac), (ac, ac)))
    d1, d2 = np.sum(ab * ap, 1), np.sum(ac * ap, 1)
    det = np.maximum(g11 * g22 - g12**2, 1e-300)
    u, v = (g22 * d1 - g12 * d2) / det, (g11 * d2 - g12 * d1) / det
    candidates = [
        np.where(((u >= 0) & (v >= 0) & (u + v <= 1))[:, None], a + u[:, None] * ab + v[:, None] * ac, np.inf)
    ]
    for start, along in ((a, ab), (a, ac), (corners[:, 1], ac - ab)):
        t = np.clip(np.sum((point - start) * along, 1) / np.maximum(np.sum(along**2, 1), 1e-300), 0.0, 1.0)
        candidates.append(start + t[:, None] * along)
    every = np.concatenate(candidates)
    return np.asarray(every[np.argmin(np.sum((every - point) ** 2, axis=1))])


def _check(what: str, friction: float, *numbers: FloatArray) -> None:
    if not (np.isfinite(friction) and friction >= 0):
        raise InputError(f"{what}: friction must be finite and not negative, but is {friction!r}")
    if not all(np.isfinite(n).all() for n in numbers):
        raise InputError(f"{what}: a coordinate is not finite")
