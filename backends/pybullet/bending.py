"""Bending of sheets: a constant matrix for one that is flat at rest, hinges for any other."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.body import Body
from ...core.plate import bending_matrix
from .compiled import compiled
from .hinges import hinge_form, hinges
from .sparse import Rows, rows_of


class BendingKernels(NamedTuple):
    """Compiled for one kind of sheet; both set ``out (V, 3)``."""

    kind: str
    #: ``(data, positions, out)``: nodal forces [N], and remember the shape.
    forces: Callable[[Any, FloatArray, FloatArray], None]
    #: ``(data, motion, out)``: stiffness of that shape times a motion.
    stiffness: Callable[[Any, FloatArray, FloatArray], None]


class Bending(ABC):
    """What a sheet's bending adds."""

    #: What the kernels work on.
    data: Any
    #: Own stiffness of every vertex ``(V,)`` [N/m].
    diagonal: FloatArray

    @staticmethod
    @abstractmethod
    def kernels() -> BendingKernels: ...

    def forces(self, positions: FloatArray) -> FloatArray:
        """Nodal forces ``(V, 3)`` [N]."""
        out = np.empty(positions.shape)
        self.kernels().forces(self.data, np.ascontiguousarray(positions), out)
        return out


class FlatBending(Bending):
    """Of a sheet that is flat at rest: force = -D Q x with the matrix of :func:`~muslin.core.plate.bending_matrix`.

    Args:
        body: flat mesh.
        rigidity: D [N m].
        weft_ratio: D along the weft over that along the warp [1].
        held: indices ``(H,)`` of the held vertices.
    """

    def __init__(self, body: Body, rigidity: float, weft_ratio: float, held: IntArray) -> None:
        matrix = rigidity * bending_matrix(body, held, weft_ratio)
        self.diagonal = np.diag(matrix).copy()
        self.data = rows_of(matrix)

    @staticmethod
    @cache
    def kernels() -> BendingKernels:
        return BendingKernels("flat", compiled(flat_forces, "flat"), compiled(flat_stiffness, "flat"))


def flat_forces(data: Rows, positions: FloatArray, out: FloatArray) -> None:
    """Set ``out`` to -D Q x."""
    for i in range(len(out)):
        x = y = z = 0.0
        for entry in range(data.start[i], data.start[i + 1]):
            j, value = data.columns[entry], data.values[entry]
            x -= value * positions[j, 0]
            y -= value * positions[j, 1]
            z -= value * positions[j, 2]
        out[i, 0], out[i, 1], out[i, 2] = x, y, z


def flat_stiffness(data: Rows, motion: FloatArray, out: FloatArray) -> None:
    """Set ``out`` to D Q x."""
    for i in range(len(out)):
        x = y = z = 0.0
        for entry in range(data.start[i], data.start[i + 1]):
            j, value = data.columns[entry], data.values[entry]
            x += value * motion[j, 0]
            y += value * motion[j, 1]
            z += value * motion[j, 2]
        out[i, 0], out[i, 1], out[i, 2] = x, y, z


class HingeData(NamedTuple):
    """Of N hinges.

    Args:
        hinges: the edge's ends and the corners beside it ``(N, 4)``.
        rest: angles at rest ``(N,)``.
        form: D times twice the energy as a form in the angles.
        change: of the angles in the remembered shape ``(N,)``.
        slopes: of the angles there, in the four vertices ``(N, 4, 3)`` [1/m].
    """

    hinges: IntArray
    rest: FloatArray
    form: Rows
    change: FloatArray
    slopes: FloatArray


class CurvedBending(Bending):
    r"""Of a sheet of any rest shape, by the angles of its hinges.

    The energy of :func:`~muslin.core.plate.bending_matrix` with the change :math:`\theta - \theta_0` of every
    hinge's angle times its length in place of the linear bend of a flat sheet; on a flat one both agree for
    small angles. Where the curvature of the triangles around a vertex is averaged, each is first turned
    into the vertex's tangent plane.

    Args:
        body: mesh in its rest shape.
        rigidity: D [N m].
        weft_ratio: D along the weft over that along the warp [1].
        held: indices ``(H,)`` of the held vertices.

    References:
        Grinspun, Hirani, Desbrun and Schroeder, *Discrete shells*, 2003, for the angles as measure of bending.
    """

    def __init__(self, body: Body, rigidity: float, weft_ratio: float, held: IntArray) -> None:
        inner, sides = hinges(body)
        count = len(inner)
        form = rigidity * hinge_form(body, inner, sides, weft_ratio, held)
        self.data = HingeData(inner, np.zeros(count), rows_of(form), np.zeros(count), np.zeros((count, 4, 3)))
        self.forces(body.vertices)
        self.data.rest[:] = self.data.change
        own = np.abs(form).sum(axis=1)[:, None] * (self.data.slopes**2).sum(axis=2)
        self.diagonal = np.asarray(np.bincount(inner.ravel(), own.ravel(), len(body.vertices)), np.float64)

    @staticmethod
    @cache
    def kernels() -> BendingKernels:
        parts = {"moments": compiled(moments, "curved")}
        return BendingKernels(
            "curved", compiled(curved_forces, "curved", **parts), compiled(curved_stiffness, "curved", **parts)
        )


def moments(data: HingeData, angles: FloatArray, sign: float, out: FloatArray) -> None:
    """Set ``out (V, 3)`` to ``sign`` times the slopes times the form times ``angles (N,)``."""
    out[:] = 0.0
    for h in range(len(angles)):
        moment = 0.0
        for entry in range(data.form.start[h], data.form.start[h + 1]):
            moment += data.form.values[entry] * angles[data.form.columns[entry]]
        moment *= sign
        for corner in range(4):
            vertex = data.hinges[h, corner]
            for k in range(3):
                out[vertex, k] += moment * data.slopes[h, corner, k]


def curved_forces(data: HingeData, positions: FloatArray, out: FloatArray) -> None:
    """Set ``out`` to the forces."""
    for h in range(len(data.hinges)):
        a, b = positions[data.hinges[h, 0]], positions[data.hinges[h, 1]]
        c, d = positions[data.hinges[h, 2]], positions[data.hinges[h, 3]]
        square = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2
        size = np.sqrt(square)
        one = two = both = sine = along_c = along_d = 0.0
        slopes = data.slopes[h]
        for k in range(3):
            m, n = (k + 1) % 3, (k + 2) % 3
            first = (b[m] - a[m]) * (c[n] - a[n]) - (b[n] - a[n]) * (c[m] - a[m])
            second = (d[m] - a[m]) * (b[n] - a[n]) - (d[n] - a[n]) * (b[m] - a[m])
            slopes[2, k], slopes[3, k] = first, second  # normals, for now
            one += first * first
            two += second * second
            both += first * second
            along_c += (c[k] - a[k]) * (b[k] - a[k]) / size
            along_d += (d[k] - a[k]) * (b[k] - a[k]) / size
        for k in range(3):
            m, n = (k + 1) % 3, (k + 2) % 3
            turn = slopes[3, m] * slopes[2, n] - slopes[3, n] * slopes[2, m]
            sine += turn * (b[k] - a[k]) / size
        one, two = max(one, 1e-9 * square * square), max(two, 1e-9 * square * square)  # a collapsed one has no normal
        change = np.arctan2(sine, both) - data.rest[h]
        data.change[h] = change - 2.0 * np.pi * np.round(change / (2.0 * np.pi))
        for k in range(3):
            first, second = slopes[2, k] / one, slopes[3, k] / two
            towards = along_c * first + along_d * second
            slopes[0, k], slopes[1, k] = towards - size * (first + second), -towards
            slopes[2, k], slopes[3, k] = size * first, size * second
    moments(data, data.change, -1.0, out)


def curved_stiffness(data: HingeData, motion: FloatArray, out: FloatArray) -> None:
    """Set ``out`` to the stiffness times ``motion (V, 3)``."""
    rates = np.zeros(len(data.hinges))
    for h in range(len(rates)):
        for corner in range(4):
            vertex = data.hinges[h, corner]
            for k in range(3):
                rates[h] += data.slopes[h, corner, k] * motion[vertex, k]
    moments(data, rates, 1.0, out)
