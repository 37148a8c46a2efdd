"""Per-triangle forces, shared to the vertices."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.body import Body

#: Density of air at 20 degrees C and 101 325 Pa [kg/m3].
AIR_DENSITY = 1.204


class Surface:
    """The triangles of a body, with what is needed to act on them every step.

    Corners are gathered a coordinate at a time, which keeps the loops of NumPy as long as there are triangles.
    """

    def __init__(self, body: Body) -> None:
        corners = 3 * body.triangles.T[:, None, :]
        self._slots = corners + np.arange(3)[:, None]  # (3 corners, 3 coordinates, F)
        self._cyclic = corners + np.array([0, 1, 2, 0, 1])[:, None]
        self._flat = self._slots.ravel()
        self._size = 3 * len(body.vertices)
        # Air touches both sides of a sheet, which one orientation of each triangle stands for.
        self.closed = body.kind == "solid"

    def area_vectors(self, positions: FloatArray) -> FloatArray:
        """Area times unit normal ``(F, 3)`` [m2]."""
        a, b, c = positions.ravel().take(self._cyclic)
        one, two = b - a, c - a
        normal = one[1:4] * two[2:5]
        normal -= one[2:5] * two[1:4]
        normal *= 0.5
        return np.asarray(normal.T)

    def mean(self, values: FloatArray) -> FloatArray:
        """Mean over the corners ``(F, 3)`` of vertex values ``(V, 3)``."""
        a, b, c = values.ravel().take(self._slots)
        a += b
        a += c
        a /= 3.0
        return np.asarray(a.T)

    def to_vertices(self, forces: FloatArray) -> FloatArray:
        """A third of each triangle force ``(F, 3)`` to each of its corners: ``(V, 3)``."""
        thirds = np.broadcast_to(forces.T / 3.0, self._slots.shape)
        sums: FloatArray = np.bincount(self._flat, thirds.ravel(), self._size).astype(np.float64)
        return sums.reshape(-1, 3)


def plate_force(area_vectors: FloatArray, relative: FloatArray, drag: float, lift: float, closed: bool) -> FloatArray:
    """Drag and lift of the air on flat triangles ``(F, 3)`` [N].

    With n the unit normal on the leading side (v_r . n >= 0), v_r the velocity of the triangle
    relative to the air and A its area (Wilson et al. 2014, "Simulating wind effects on cloth and hair
    in Disney's Frozen", after Ling, Damodaran and Gay 1996)::

        f = -1/2 rho A [ (C_D - C_L) (v_r . n) v_r + C_L |v_r|^2 n ]

    A sheet feels it once per triangle whichever side leads; on a closed surface only the faces that
    move into the air feel it. Where a sheet moves exactly edge-on, its leading side is undefined and
    the lift jumps from one sign to the other, as the law has it. Broadside (v_r parallel to n) the
    force is 1/2 rho A C_D |v_r|^2.
    """
    # With S = A n for either n, all that is asked of the leading side is |v_r . S| and the sign of S.
    through = np.einsum("fi,fi->f", relative, area_vectors)
    if closed:
        through = np.maximum(through, 0.0)
    out = ((drag - lift) * np.abs(through))[:, None] * relative
    if lift != 0.0:
        lifted = lift * np.einsum("fi,fi->f", relative, relative)
        side = np.sign(through) if closed else np.copysign(1.0, through)
        out += (lifted * side)[:, None] * area_vectors
    out *= -0.5 * AIR_DENSITY
    return np.asarray(out)
