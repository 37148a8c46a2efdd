"""Per-triangle forces, shared to the vertices."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.body import Body

#: Density of air at 20 degrees C and 101 325 Pa [kg/m3].
AIR_DENSITY = 1.204


class Surface:
    """The triangles of a body, with what is needed to act on them every step."""

    def __init__(self, body: Body) -> None:
        self._triangles = body.triangles
        self._a, self._b, self._c = body.triangles.T
        self._count = len(body.vertices)
        # Air touches both sides of a sheet, which one orientation of each triangle stands for.
        self.closed = body.kind == "solid"

    def area_vectors(self, positions: FloatArray) -> FloatArray:
        """Area times unit normal ``(F, 3)`` [m2]."""
        a = positions[self._a]
        return np.asarray(0.5 * np.cross(positions[self._b] - a, positions[self._c] - a))

    def mean(self, values: FloatArray) -> FloatArray:
        """Mean over the corners ``(F, 3)`` of vertex values ``(V, 3)``."""
        return np.asarray((values[self._a] + values[self._b] + values[self._c]) / 3.0)

    def to_vertices(self, forces: FloatArray) -> FloatArray:
        """A third of each triangle force ``(F, 3)`` to each of its corners: ``(V, 3)``."""
        out = np.empty((self._count, 3))
        third = np.repeat(forces / 3.0, 3, axis=0)
        index = self._triangles.ravel()
        for axis in range(3):
            out[:, axis] = np.bincount(index, third[:, axis], minlength=self._count)
        return out


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
    area = np.linalg.norm(area_vectors, axis=1, keepdims=True)
    normal = area_vectors / np.maximum(area, 1e-300)
    along = np.einsum("fi,fi->f", relative, normal)[:, None]
    if closed:
        area = np.where(along > 0, area, 0.0)
    else:
        normal = np.where(along < 0, -normal, normal)
        along = np.abs(along)
    speed2 = np.einsum("fi,fi->f", relative, relative)[:, None]
    return np.asarray(-0.5 * AIR_DENSITY * area * ((drag - lift) * along * relative + lift * speed2 * normal))
