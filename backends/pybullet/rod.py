"""Ropes: stretching and bending of a discrete elastic rod that may twist freely."""

from functools import cache
from typing import NamedTuple

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.bending import rope_rigidities
from ...core.body import Body
from ...core.clamps import clamped_segments
from ...core.material import RopeMaterial
from .compiled import compiled
from .elasticity import Elasticity, Kernels, kernels

#: Rest curvature is rounded off by this share of itself, so that a straightened vertex has a finite frequency.
_ROUNDING = 0.1
#: Turn of a vertex [1] beyond which rotating the plane of its bend is no longer taken for bending.
_STRAIGHT = 0.02


class RodData(NamedTuple):
    """Of E segments and N inner vertices.

    Args:
        rest: lengths ``(E,)`` [m].
        axial: EA over length ``(E,)`` [N/m].
        bending: EI over length ``(N,)`` [N m].
        turn: angles at rest ``(N,)``, rounded off.
        round: squares of the rounding ``(N,)``.
        unit: directions of the segments ``(E, 3)`` of the remembered shape.
        inverse: of their lengths there ``(E,)`` [1/m].
        turned: sine and cosine of the angles there ``(N, 2)``.
    """

    rest: FloatArray
    axial: FloatArray
    bending: FloatArray
    turn: FloatArray
    round: FloatArray
    unit: FloatArray
    inverse: FloatArray
    turned: FloatArray


class Rod(Elasticity):
    r"""A chain of segments with vertices as hinges.

    .. math:: W = \sum_e \frac{EA\, (l - l_0)^2}{2 l_0} + \sum_i \frac{EI}{2 \bar{l}_i} (\phi_i - \phi_{0i})^2

    with :math:`\phi` the angle between the segments at a vertex and :math:`\bar{l}` half their rest lengths'
    sum: discrete elastic rods of round cross-section with the angle for :math:`2 \tan(\phi / 2)`, which is equal for
    small ones and stays finite in a fold. Torsion costs nothing here: the material frame turns to where the
    rest curvature fits best, so that only the size of the curvature counts.

    Segments with both ends held are clamps. The vertex between a clamp and the rope turns by what half a
    segment bends, and is therefore twice as stiff; a cantilever then begins at the clamp's last vertex.

    Args:
        body: rope in its rest shape.
        material: of the rope.
        held: indices ``(H,)`` of the held vertices.

    References:
        Bergou, Wardetzky, Robinson, Audoly and Grinspun, *Discrete elastic rods*, 2008, equations 1 and 4.
    """

    def __init__(self, body: Body, material: RopeMaterial, held: IntArray) -> None:
        self.kernels = _kernels()
        rest = np.array(body.measures, np.float64)
        unit = np.diff(body.vertices, axis=0) / rest[:, None]
        clamped = clamped_segments(body, held)
        mean = 0.5 * (rest[:-1] + rest[1:])
        bending = rope_rigidities(body, material) / mean * np.where(clamped[:-1] ^ clamped[1:], 2.0, 1.0)
        turn = 2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(np.diff(unit, axis=0), axis=1), 0.0, 1.0))
        turn[turn < 1e-6] = 0.0
        rounding = (_ROUNDING * turn) ** 2 + 1e-12
        self._plain = material.stretch_stiffness / rest
        self.data = RodData(
            rest,
            self._plain.copy(),
            bending,
            np.sqrt(turn**2 + rounding) * (turn > 0),
            rounding,
            np.zeros((len(rest), 3)),
            np.zeros(len(rest)),
            np.zeros((len(turn), 2)),
        )
        self._bending_diagonal = np.zeros(len(body.vertices))
        self._bending_diagonal[1:-1] += bending * (1.0 / rest[:-1] + 1.0 / rest[1:]) ** 2
        self._bending_diagonal[:-2] += bending / rest[:-1] ** 2
        self._bending_diagonal[2:] += bending / rest[1:] ** 2
        self.scale_stretch(None)

    def scale_stretch(self, factor: FloatArray | None) -> None:
        axial = self.data.axial
        axial[:] = self._plain if factor is None else self._plain * factor
        self.diagonal = self._bending_diagonal.copy()
        self.diagonal[:-1] += axial
        self.diagonal[1:] += axial


@cache
def _kernels() -> Kernels:
    return kernels("rope", compiled(rod_forces, "rope"), compiled(rod_stiffness, "rope"))


def rod_forces(data: RodData, positions: FloatArray, out: FloatArray) -> None:
    """Elastic nodal forces ``out (V, 3)`` [N]."""
    unit, inverse = data.unit, data.inverse
    out[:] = 0.0
    for e in range(len(unit)):
        square = 0.0
        for k in range(3):
            unit[e, k] = positions[e + 1, k] - positions[e, k]
            square += unit[e, k] * unit[e, k]
        length = np.sqrt(square)
        inverse[e] = 1.0 / length
        tension = data.axial[e] * (length - data.rest[e])
        for k in range(3):
            unit[e, k] *= inverse[e]
            out[e, k] += tension * unit[e, k]
            out[e + 1, k] -= tension * unit[e, k]
    for n in range(len(data.bending)):
        u, v = unit[n], unit[n + 1]
        square = 0.0  # of 2 sin(angle / 2)
        for k in range(3):
            square += (v[k] - u[k]) ** 2
        half = min(max(0.5 * np.sqrt(square), 1e-9), 1.0 - 1e-9)
        angle, sine, cosine = 2.0 * np.arcsin(half), 2.0 * half * np.sqrt(1.0 - half * half), 1.0 - 0.5 * square
        data.turned[n, 0], data.turned[n, 1] = sine, cosine
        pull = data.bending[n] * angle / sine
        if data.turn[n] > 0:
            pull *= 1.0 - data.turn[n] / np.sqrt(angle * angle + data.round[n])
        for k in range(3):
            first = pull * inverse[n] * (v[k] - cosine * u[k])
            second = pull * inverse[n + 1] * (u[k] - cosine * v[k])
            out[n, k] -= first
            out[n + 1, k] += first - second
            out[n + 2, k] += second


def rod_stiffness(data: RodData, motion: FloatArray, out: FloatArray) -> None:
    """Stiffness times ``motion (V, 3)``.

    The angle's rate is -(m.u' + n.v') for motions u', v' of a vertex's two segments, with m and n in the plane of
    the bend. Any other turn is taken for bending as long as there is hardly a plane.
    """
    unit, inverse = data.unit, data.inverse
    out[:] = 0.0
    turned = np.empty_like(unit)  # rates of the directions
    for e in range(len(unit)):
        along = 0.0
        for k in range(3):
            turned[e, k] = motion[e + 1, k] - motion[e, k]
            along += unit[e, k] * turned[e, k]
        for k in range(3):
            pull = data.axial[e] * along * unit[e, k]
            out[e, k] -= pull
            out[e + 1, k] += pull
            turned[e, k] = (turned[e, k] - along * unit[e, k]) * inverse[e]
    for n in range(len(data.bending)):
        u, v, sine, cosine = unit[n], unit[n + 1], data.turned[n, 0], data.turned[n, 1]
        straight = data.bending[n] / (1.0 + (sine / _STRAIGHT) ** 2)
        rate = along_u = along_v = 0.0
        for k in range(3):
            rate += (v[k] - cosine * u[k]) * turned[n, k] + (u[k] - cosine * v[k]) * turned[n + 1, k]
            along_u += u[k] * (turned[n + 1, k] - turned[n, k])
            along_v += v[k] * (turned[n + 1, k] - turned[n, k])
        bent = (data.bending[n] - straight) * rate / (sine * sine)
        for k in range(3):
            change = turned[n + 1, k] - turned[n, k]
            first = inverse[n] * (bent * (v[k] - cosine * u[k]) - straight * (change - u[k] * along_u))
            second = inverse[n + 1] * (bent * (u[k] - cosine * v[k]) + straight * (change - v[k] * along_v))
            out[n, k] -= first
            out[n + 1, k] += first - second
            out[n + 2, k] += second
