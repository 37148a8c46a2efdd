"""The deformable object itself: a mesh and what kind of continuum it stands for."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from .arrays import FloatArray, IntArray
from .errors import InputError

Kind = Literal["cloth", "rope", "solid"]
#: Vertices of an element by kind: segments, triangles, tetrahedra.
CORNERS: dict[str, int] = {"rope": 2, "cloth": 3, "solid": 4}


@dataclass(frozen=True, eq=False)
class Body:
    """A mesh at rest.

    Args:
        kind: ``"rope"`` (segments), ``"cloth"`` (triangles) or ``"solid"`` (tetrahedra).
        vertices: rest positions ``(V, 3)`` [m].
        elements: segments ``(E, 2)``, one open chain in the order of the vertices; triangles ``(E, 3)``; or
            positively oriented tetrahedra ``(E, 4)``.
        grid: vertex counts along the axes if the mesh is a regular grid, last index fastest.
        warp: of cloth, where the warp threads run: ``(E, 2)`` shares of a triangle's first and second edge
            (from its first vertex), so that they follow the cloth however it lies. None: along the z axis
            of the rest shape as given, or along x in triangles that lie level.
    """

    kind: Kind
    vertices: FloatArray
    elements: IntArray
    grid: tuple[int, ...] | None = None
    warp: FloatArray | None = None

    def __post_init__(self) -> None:
        corners = CORNERS[self.kind]
        if self.elements.ndim != 2 or self.elements.shape[1] != corners:
            raise InputError(f"a {self.kind} needs elements of {corners} vertices, got shape {self.elements.shape}")
        if self.elements.min() < 0 or self.elements.max() >= len(self.vertices):
            raise InputError(
                f"the mesh has {len(self.vertices)} vertices, but an element names vertex {self.elements.max()}"
            )
        if not np.isfinite(self.vertices).all():
            raise InputError("the mesh has a vertex that is not finite")
        if self.kind == "rope":
            chain = np.arange(len(self.vertices) - 1)
            if not np.array_equal(self.elements, np.stack([chain, chain + 1], axis=1)):
                raise InputError("a rope is one open chain: its elements must be [0, 1], [1, 2], ... in this order")
        if self.kind == "cloth" and self.warp is None:
            object.__setattr__(self, "warp", _upright_warp(self.vertices[self.elements]))

    @cached_property
    def triangles(self) -> IntArray:
        """The surface ``(F, 3)``; of a solid the boundary faces, outward; of a rope none."""
        if self.kind == "cloth":
            return self.elements
        if self.kind == "rope":
            return np.zeros((0, 3), np.int64)
        t = self.elements
        faces = np.concatenate([t[:, [1, 2, 3]], t[:, [0, 3, 2]], t[:, [0, 1, 3]], t[:, [0, 2, 1]]])
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        return np.asarray(faces[first[count == 1]])

    @cached_property
    def edges(self) -> IntArray:
        """Unique edges of the elements ``(N, 2)``."""
        k = self.elements.shape[1]
        pairs = np.sort(np.concatenate([self.elements[:, [i, j]] for i in range(k) for j in range(i + 1, k)]), axis=1)
        one = np.unique(pairs[:, 0] * len(self.vertices) + pairs[:, 1])  # far faster than unique rows
        return np.stack(np.divmod(one, len(self.vertices)), axis=1)

    @cached_property
    def measures(self) -> FloatArray:
        """Length [m], area [m2] or volume [m3] of every element ``(E,)``."""
        p = self.vertices[self.elements]
        if self.kind == "rope":
            return np.asarray(np.linalg.norm(p[:, 1] - p[:, 0], axis=1))
        if self.kind == "cloth":
            return np.asarray(0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1))
        return np.asarray(np.abs(np.linalg.det(p[:, 1:] - p[:, :1])) / 6.0)

    @cached_property
    def vertex_measures(self) -> FloatArray:
        """The share of length, area or volume of each vertex ``(V,)``: times density, the lumped mass [kg]."""
        share = np.repeat(self.measures / self.elements.shape[1], self.elements.shape[1])
        return np.asarray(np.bincount(self.elements.ravel(), share, minlength=len(self.vertices)), np.float64)

    def edge_lengths(self, positions: FloatArray) -> FloatArray:
        """Lengths ``(..., N)`` [m] of the edges at ``positions (..., V, 3)``."""
        ends = positions[..., self.edges, :]
        return np.asarray(np.linalg.norm(ends[..., 1, :] - ends[..., 0, :], axis=-1))

    def warp_directions(self, positions: FloatArray) -> FloatArray:
        """Unit vectors ``(E, 3)`` along the warp threads of every triangle at ``positions (V, 3)``; cloth only."""
        assert self.warp is not None
        p = positions[self.elements]
        along = np.einsum("ei,eix->ex", self.warp, p[:, 1:] - p[:, :1])
        return np.asarray(along / np.linalg.norm(along, axis=1, keepdims=True))

    def scaled(self, factor: float, about: FloatArray) -> "Body":
        """``factor`` times as large, the point ``about (3,)`` [m] staying where it is."""
        return replace(self, vertices=about + (self.vertices - about) * factor)


def _upright_warp(corners: FloatArray) -> FloatArray:
    """Edge shares ``(E, 2)`` of the z axis laid into every triangle ``corners (E, 3, 3)``, of x where it is level."""
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    area = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.where(area > 0, area, 1.0)
    level = np.abs(normal[:, 2:]) > 0.99
    axis = np.where(level, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    inside = axis - np.sum(axis * normal, axis=1, keepdims=True) * normal
    inside /= np.linalg.norm(inside, axis=1, keepdims=True)
    return np.asarray(np.einsum("exi,ex->ei", np.linalg.pinv(edges).transpose(0, 1, 2), inside))


def rope_line(points: FloatArray, count: int) -> Body:
    """A rope along a polyline, cut into segments of equal length.

    Args:
        points: corners of the polyline ``(P, 3)`` [m], at least two.
        count: vertices, at least two.
    """
    if count < 2 or len(points) < 2:
        raise InputError(f"a rope needs at least 2 vertices on at least 2 points, got {count} on {len(points)}")
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    if not along[-1] > 0:
        raise InputError("a rope needs a length; all its points coincide")
    where = np.linspace(0.0, along[-1], count)
    vertices = np.stack([np.interp(where, along, points[:, k]) for k in range(3)], axis=1)
    chain = np.arange(count - 1)
    return Body("rope", vertices, np.stack([chain, chain + 1], axis=1), (count,))


def cloth_grid(width: float, height: float, columns: int, rows: int) -> Body:
    """A rectangular sheet hanging in the x-z plane, top edge at z = 0, centred on x = 0.

    Vertex ``row * columns + column``; row 0 is the top edge. Diagonals alternate, so that the mesh
    prefers no direction. The warp runs along the columns, from the top edge down.
    """
    if columns < 2 or rows < 2:
        raise InputError(f"a cloth grid needs at least 2 x 2 vertices, got {columns} x {rows}")
    x, z = np.linspace(-width / 2, width / 2, columns), np.linspace(0.0, -height, rows)
    zz, xx = np.meshgrid(z, x, indexing="ij")
    vertices = np.stack([xx, np.zeros_like(xx), zz], axis=-1).reshape(-1, 3)
    triangles = []
    for r in range(rows - 1):
        for c in range(columns - 1):
            a = r * columns + c
            b, d, e = a + 1, a + columns, a + columns + 1
            triangles += [[a, d, e], [a, e, b]] if (r + c) % 2 else [[a, d, b], [b, d, e]]
    return Body("cloth", vertices, np.array(triangles, dtype=np.int64), (rows, columns))


def solid_box(low: FloatArray, high: FloatArray, counts: tuple[int, int, int]) -> Body:
    """A box of ``counts`` vertices along x, y, z (z fastest), six tetrahedra a cell (Kuhn)."""
    if min(counts) < 2:
        raise InputError(f"a solid box needs at least 2 vertices along each axis, got {counts}")
    axes = [np.linspace(a, b, n) for a, b, n in zip(low, high, counts, strict=True)]
    vertices = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    index = np.arange(len(vertices)).reshape(counts)
    corners = np.stack(
        [
            index[a : counts[0] - 1 + a, b : counts[1] - 1 + b, c : counts[2] - 1 + c].ravel()
            for a in (0, 1)
            for b in (0, 1)
            for c in (0, 1)
        ],
        axis=1,
    )
    paths = [(0, 1, 3, 7), (0, 5, 1, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 4, 5, 7), (0, 6, 4, 7)]
    tetrahedra = np.concatenate([corners[:, list(p)] for p in paths])
    edges = vertices[tetrahedra[:, 1:]] - vertices[tetrahedra[:, :1]]
    flipped = np.linalg.det(edges) < 0
    tetrahedra[flipped, 1], tetrahedra[flipped, 2] = tetrahedra[flipped, 2], tetrahedra[flipped, 1].copy()
    return Body("solid", vertices, tetrahedra, counts)
