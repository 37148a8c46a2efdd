"""Ropes: stretching and bending of a discrete elastic rod that may twist freely."""

import numpy as np

from ...core.arrays import BoolArray, FloatArray, IntArray
from ...core.body import Body
from ...core.material import RopeMaterial
from .elasticity import Elasticity

#: Rest curvature is rounded off by this share of itself, so that a straightened vertex has a finite frequency.
_ROUNDING = 0.1
#: Turn of a vertex [1] beyond which rotating the plane of its bend is no longer taken for bending.
_STRAIGHT = 0.02


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
        edges = np.diff(body.vertices, axis=0)
        self._rest = body.measures
        self._plain = material.stretch_stiffness / self._rest
        self._axial = self._plain
        clamped: BoolArray = np.all(np.isin(body.elements, held), axis=1)
        half = clamped[:-1] ^ clamped[1:]
        mean = 0.5 * (self._rest[:-1] + self._rest[1:])
        self._bending = material.bending_rigidity / mean * np.where(half, 2.0, 1.0)
        unit = edges / self._rest[:, None]
        turn = _angle(unit)[0]
        turn[turn < 1e-6] = 0.0
        self._curved = bool(turn.any())
        self._round = (_ROUNDING * turn) ** 2 + 1e-12
        self._turn = np.sqrt(turn**2 + self._round) * (turn > 0)
        sides = self._bending * (1.0 / self._rest[:-1] + 1.0 / self._rest[1:]) ** 2
        self.diagonal = np.zeros(len(body.vertices))
        self.diagonal[1:-1] += sides
        self.diagonal[:-2] += self._bending / self._rest[:-1] ** 2
        self.diagonal[2:] += self._bending / self._rest[1:] ** 2
        self._bending_diagonal = self.diagonal
        self.scale_stretch(None)

    def scale_stretch(self, factor: FloatArray | None) -> None:
        self._axial = self._plain if factor is None else self._plain * factor
        self.diagonal = self._bending_diagonal.copy()
        self.diagonal[:-1] += self._axial
        self.diagonal[1:] += self._axial

    def forces(self, positions: FloatArray) -> FloatArray:
        edges = positions[1:] - positions[:-1]
        length = np.sqrt(np.einsum("ij,ij->i", edges, edges))
        inverse = (1.0 / length)[:, None]
        unit = edges * inverse
        u, v = unit[:-1], unit[1:]
        angle, sine, cosine = _angle(unit)
        pull = self._bending * angle / sine
        if self._curved:
            pull *= 1.0 - self._turn / np.sqrt(angle * angle + self._round)
        self._unit, self._inverse, self._sine, self._cosine = unit, inverse, sine, cosine
        self._bends: tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None = None
        load = unit * (self._axial * (length - self._rest))[:, None]
        along = cosine[:, None]
        pull = pull[:, None]
        load[:-1] -= pull * inverse[:-1] * (v - along * u)
        load[1:] -= pull * inverse[1:] * (u - along * v)
        return _ends(load)

    def stiffness(self, motion: FloatArray) -> FloatArray:
        if self._bends is None:
            self._bends = self._planes()
        m, n, flat, straight = self._bends
        unit, inverse = self._unit, self._inverse
        moved = motion[1:] - motion[:-1]
        along = np.einsum("ij,ij->i", unit, moved)[:, None]
        load = unit * (self._axial[:, None] * along)
        rate = np.einsum("ij,ij->i", m, moved[:-1])
        rate += np.einsum("ij,ij->i", n, moved[1:])
        bent = (flat * rate)[:, None]
        load[:-1] += bent * m
        load[1:] += bent * n
        turned = (moved - unit * along) * inverse
        out = straight * (turned[1:] - turned[:-1])
        u, v = unit[:-1], unit[1:]
        load[:-1] -= inverse[:-1] * (out - u * np.einsum("ij,ij->i", u, out)[:, None])
        load[1:] += inverse[1:] * (out - v * np.einsum("ij,ij->i", v, out)[:, None])
        return -_ends(load)

    def _planes(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Of the last shape, what :meth:`stiffness` needs.

        The angle's rate is -(m.u' + n.v') for motions u', v' of a vertex's two segments, with ``m, n (N, 3)`` in the
        plane of the bend; the stiffness ``(N,)`` against it; and against any other turn ``(N, 1)``, as long as
        there is hardly a plane.
        """
        u, v, cosine = self._unit[:-1], self._unit[1:], self._cosine[:, None]
        m = (v - cosine * u) / self._sine[:, None] * self._inverse[:-1]
        n = (u - cosine * v) / self._sine[:, None] * self._inverse[1:]
        straight = self._bending / (1.0 + (self._sine / _STRAIGHT) ** 2)
        return m, n, self._bending - straight, straight[:, None]


def _angle(unit: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Angles ``(N,)`` between consecutive ``unit (N + 1, 3)`` vectors, their sines (never zero) and cosines."""
    apart = unit[1:] - unit[:-1]
    square = np.einsum("ij,ij->i", apart, apart)  # of 2 sin(angle / 2)
    half = 0.5 * np.sqrt(square)
    np.clip(half, 1e-9, 1.0 - 1e-9, out=half)
    return 2.0 * np.arcsin(half), 2.0 * half * np.sqrt(1.0 - half * half), 1.0 - 0.5 * square


def _ends(load: FloatArray) -> FloatArray:
    """Nodal forces ``(V, 3)`` of segments that pull their ends together by ``load (E, 3)``."""
    forces = np.empty((len(load) + 1, 3))
    forces[0], forces[-1] = load[0], -load[-1]
    np.subtract(load[1:], load[:-1], out=forces[1:-1])
    return forces
