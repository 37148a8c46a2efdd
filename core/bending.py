"""How much a sheet or a rope is bent, in its material frame, and what forces moments make of that."""

from abc import ABC, abstractmethod

import numpy as np

from .arrays import FloatArray, IntArray, cross, dot
from .body import Body
from .clamps import clamped_segments
from .material import RopeMaterial

#: Share of a hinge's bending that goes to either end of its edge and to either opposite vertex.
_SHARES = np.array([1 / 3, 1 / 3, 1 / 6, 1 / 6])
_NONE: IntArray = np.zeros(0, np.int64)


class Bending(ABC):
    """Curvature at N places of an object, d numbers each; fixed in the material, so rigid motion changes none.

    Follow the object first, then read :attr:`curvature`, ask for :meth:`rates` and :meth:`forces`. These two
    are transposes of each other: the power of the forces is minus the sum of measure x moment . rate, exactly.

    Attributes:
        measures: length [m] or area [m2] that each place stands for ``(N,)``.
        rest: curvature of the rest shape ``(N, d)`` [1/m].
        curvature: where the object was last followed to ``(N, d)`` [1/m].
    """

    measures: FloatArray
    rest: FloatArray
    curvature: FloatArray

    @abstractmethod
    def follow(self, positions: FloatArray) -> None:
        """The vertices are now at ``positions (V, 3)`` [m]."""

    @abstractmethod
    def rates(self, velocities: FloatArray) -> FloatArray:
        """Rates of the curvature ``(N, d)`` [1/(m s)] at ``velocities (V, 3)`` [m/s]."""

    @abstractmethod
    def forces(self, moments: FloatArray) -> FloatArray:
        """Nodal forces ``(V, 3)`` [N] of an object that resists bending with ``moments (N, d)``.

        Moments of a sheet are per length [N], of a rope whole ones [N m].
        """

    def stiffest(self, masses: FloatArray, held: IntArray) -> float:
        """Square of the fastest angular frequency [1/s2] per bending rigidity, where the object was followed to.

        By 30 steps of the power method, with a tenth on top for what is left to converge.
        """
        mobility = 1.0 / masses[:, None]
        mobility[held] = 0.0
        shape = np.random.default_rng(0).normal(size=(len(masses), 3)) * mobility
        size = 0.0
        for _ in range(30):
            length = float(np.linalg.norm(shape))
            if length == 0.0:
                return 0.0
            shape = -mobility * self.forces(self.rates(shape / length))
            size = float(np.linalg.norm(shape))
        return 1.1 * size


def bending_of(body: Body, held: IntArray = _NONE) -> Bending:
    """The bending of a cloth or a rope of which vertices are held, followed to its rest shape."""
    return RopeBending(body, held) if body.kind == "rope" else SheetBending(body)


def rope_rigidities(body: Body, material: RopeMaterial) -> FloatArray:
    """Bending rigidity E I ``(V - 2,)`` [N m2] at the inner vertices of a rope."""
    return material.bending_rigidity * material.bending_shares(inner_places(body))


def inner_places(body: Body) -> FloatArray:
    """Where the inner vertices of a rope are, as shares of its length ``(V - 2,)``."""
    so_far = np.cumsum(body.measures)
    return np.asarray(so_far[:-1] / so_far[-1])


class SheetBending(Bending):
    r"""Curvature tensors at the vertices of any triangle mesh, from its dihedral angles.

    A hinge of length l folded by the angle :math:`\theta` bends the sheet by :math:`l \theta\, n n^T` times area,
    with n normal to the hinge in the sheet. A third of that goes to each end of the hinge and a sixth to each
    opposite vertex, which is the mean over the triangles around a vertex of the shape operators of Grinspun
    et al.; it frees regular grids from their preferred directions. A vertex has the numbers xx, yy and
    :math:`\sqrt 2` xy with x along the warp, so their norm is that of the tensor: :math:`\kappa` for a cylinder
    of that curvature, whichever way it is rolled.

    References:
        Grinspun, Gingold, Reisman and Zorin, *Computing discrete shape operators on general meshes*, 2006;
        gradients of dihedral angles: Tamstorf and Grinspun, *Discrete bending forces and their Jacobians*, 2013.
    """

    def __init__(self, body: Body) -> None:
        self._count = len(body.vertices)
        self._hinges = _hinges(body.elements)
        self.measures = body.vertex_measures
        along, across = _frames(body)
        edge = body.vertices[self._hinges[1]] - body.vertices[self._hinges[0]]
        length = np.linalg.norm(edge, axis=1)
        normal = np.stack(
            [-np.sum(edge * across[self._hinges], axis=2), np.sum(edge * along[self._hinges], axis=2)], axis=2
        )
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        x, y = normal[..., 0], normal[..., 1]
        bends = (_SHARES[:, None] * length)[..., None] * np.stack([x * x, y * y, np.sqrt(2.0) * x * y], axis=2)
        self._whole = bends  # (4, H, 3): angle to curvature times area
        self._per_area = bends / np.maximum(self.measures[self._hinges], 1e-300)[..., None]
        self._slots = (3 * self._hinges[..., None] + np.arange(3)).ravel()
        self.follow(body.vertices)
        self.rest = self.curvature

    def follow(self, positions: FloatArray) -> None:
        angles, self._gradients = _fold(positions[self._hinges])
        self.curvature = self._gather(self._per_area * angles[:, None])

    def rates(self, velocities: FloatArray) -> FloatArray:
        rates = np.einsum("chx,chx->h", self._gradients, velocities[self._hinges])
        return self._gather(self._per_area * rates[:, None])

    def forces(self, moments: FloatArray) -> FloatArray:
        hinge = np.einsum("chk,chk->h", self._whole, moments[self._hinges])
        return self._gather(-hinge[:, None] * self._gradients)

    def _gather(self, values: FloatArray) -> FloatArray:
        """Sums at the vertices ``(V, 3)`` of ``values (4, H, 3)`` at the corners of the hinges."""
        sums: FloatArray = np.bincount(self._slots, values.ravel(), minlength=3 * self._count).astype(np.float64)
        return sums.reshape(-1, 3)


class RopeBending(Bending):
    r"""Curvature vectors at the inner vertices of a rope, in frames that do not twist.

    The rope turns by the vector :math:`\theta n` at a vertex; over the mean rest length of its two
    segments that is the curvature. A segment that is held at both ends does not bend: beside it all of the turn is
    that of the other segment's half. The two numbers of a curvature are in a frame that is carried along with the
    mean tangent by the smallest rotation from state to state, as the time-parallel frames of Bergou et al. The material
    is thus taken not to spin about the rope's own axis, as in a gripper that does not: where a bent rope is swung
    round like a skipping rope, its bending goes round in the material.

    References:
        Bergou, Audoly, Vouga, Wardetzky and Grinspun, *Discrete viscous threads*, 2010.
    """

    def __init__(self, body: Body, held: IntArray = _NONE) -> None:
        self._lengths = body.measures
        bends = np.where(clamped_segments(body, held), 0.0, body.measures)
        bends = bends[1:] + bends[:-1]
        self.measures = 0.5 * np.where(bends > 0, bends, body.measures[1:] + body.measures[:-1])
        tangent = np.diff(body.vertices, axis=0)
        self._tangent = _unit(_unit(tangent)[1:] + _unit(tangent)[:-1])
        least = np.eye(3)[np.abs(self._tangent).argmin(axis=1)]
        self._first = cross(self._tangent, least)
        self.follow(body.vertices)
        self.rest = self.curvature

    def follow(self, positions: FloatArray) -> None:
        apart = positions[1:] - positions[:-1]
        self._over_length = 1.0 / np.sqrt(dot(apart, apart))[:, None]
        self._along = apart * self._over_length
        before, behind = self._along[:-1], self._along[1:]
        tangent = _unit(before + behind)
        old = self._tangent
        turned = dot(self._first, tangent) / np.maximum(1.0 + dot(old, tangent), 1e-9)
        first = self._first - turned[:, None] * (old + tangent)
        self._first = _unit(first - dot(first, tangent)[:, None] * tangent)
        self._tangent, self._second = tangent, cross(tangent, self._first)
        across = cross(before, behind)
        sine = np.sqrt(dot(across, across))[:, None]
        angle = np.arctan2(sine, dot(before, behind)[:, None])
        # The turning plane turns about the tangent at the rate that the segments turn times this.
        self._ratio = np.where(sine > 1e-9, angle / np.maximum(sine, 0.1 * angle + 1e-300), 1.0)
        self._axis = across / np.maximum(sine, 1e-300)
        self.curvature = self._in_frame(self._axis * angle) / self.measures[:, None]

    def rates(self, velocities: FloatArray) -> FloatArray:
        spin = cross(self._along, velocities[1:] - velocities[:-1]) * self._over_length
        return self._in_frame(self._answer(spin[1:] - spin[:-1])) / self.measures[:, None]

    def forces(self, moments: FloatArray) -> FloatArray:
        couple = self._answer(moments[:, :1] * self._first + moments[:, 1:] * self._second)
        out = np.zeros((len(self._lengths) + 1, 3))
        behind = cross(couple, self._along[1:]) * self._over_length[1:]
        before = cross(couple, self._along[:-1]) * self._over_length[:-1]
        out[2:] -= behind
        out[1:-1] += behind + before
        out[:-2] -= before
        return out

    @property
    def axes(self) -> FloatArray:
        """The axes that the two numbers of a curvature go with, as the rope was last followed ``(N, 2, 3)``."""
        return np.stack([self._first, self._second], axis=1)

    def _in_frame(self, vectors: FloatArray) -> FloatArray:
        out = np.empty((len(vectors), 2))
        out[:, 0], out[:, 1] = dot(vectors, self._first), dot(vectors, self._second)
        return out

    def _answer(self, vectors: FloatArray) -> FloatArray:
        """Relative spin of the segments to the rate of the turning vector; its own transpose."""
        about = dot(vectors, self._axis)[:, None] * self._axis
        return np.asarray(self._ratio * vectors + (1.0 - self._ratio) * about)


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.maximum(np.sqrt(dot(vectors, vectors)), 1e-300)[:, None])


def _hinges(triangles: IntArray) -> IntArray:
    """Ends of every edge between two triangles, then the opposite vertices, the left one first ``(4, H)``."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    apex = np.concatenate([triangles[:, 2], triangles[:, 0], triangles[:, 1]])
    order = np.lexsort((np.arange(len(ends)), ends.max(axis=1), ends.min(axis=1)))
    pairs = np.sort(ends[order], axis=1)
    twice = np.flatnonzero((pairs[1:] == pairs[:-1]).all(axis=1))
    one, two = order[twice], order[twice + 1]
    return np.stack([ends[one, 0], ends[one, 1], apex[one], apex[two]])


def _fold(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Angles ``(H,)`` [rad] by which hinges ``(4, H, 3)`` are folded, zero if flat, and gradients ``(4, H, 3)``."""
    start, end, left, right = corners
    edge, to_left, to_right = end - start, left - start, right - start
    up, down = cross(edge, to_left), cross(to_right, edge)
    length2 = dot(edge, edge)
    length = np.sqrt(length2)
    angle = np.arctan2(-dot(up, to_right) * length, dot(up, down))
    out = np.empty_like(corners)
    out[2] = up * (-length / np.maximum(dot(up, up), 1e-300))[:, None]
    out[3] = down * (-length / np.maximum(dot(down, down), 1e-300))[:, None]
    at_left = (dot(edge, to_left) / length2)[:, None]
    at_right = (dot(edge, to_right) / length2)[:, None]
    out[1] = -at_left * out[2] - at_right * out[3]
    out[0] = -out[1] - out[2] - out[3]
    return angle, out


def _frames(body: Body) -> tuple[FloatArray, FloatArray]:
    """Unit vectors along and across the warp at every vertex of the rest shape ``(V, 3)`` each."""
    p = body.vertices[body.elements]
    normals, along = np.zeros((2, len(body.vertices), 3))
    for corner in range(3):
        np.add.at(normals, body.elements[:, corner], np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]))
        np.add.at(along, body.elements[:, corner], body.measures[:, None] * body.warp_directions(body.vertices))
    normals = _unit(normals)
    along = _unit(along - np.sum(along * normals, axis=1)[:, None] * normals)
    return along, np.cross(normals, along)
