"""Per-segment forces on a rope, shared to the vertices."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.scene import Scene
from .surface import AIR_DENSITY


class Line:
    """The segments of a rope, with what is needed to act on them every step."""

    def __init__(self, scene: Scene) -> None:
        self.diameter = 2.0 * scene.contact_radius

    def segments(self, positions: FloatArray) -> FloatArray:
        """From end to end of every segment ``(E, 3)`` [m]."""
        return np.asarray(positions[1:] - positions[:-1])

    def mean(self, values: FloatArray) -> FloatArray:
        """Mean over both ends ``(E, 3)`` of vertex values ``(V, 3)``."""
        return np.asarray(0.5 * (values[1:] + values[:-1]))

    def to_vertices(self, forces: FloatArray) -> FloatArray:
        """Half of each segment force ``(E, 3)`` to each of its ends: ``(V, 3)``."""
        out = np.zeros((len(forces) + 1, 3))
        out[1:] += 0.5 * forces
        out[:-1] += 0.5 * forces
        return out


def cylinder_force(
    segments: FloatArray, relative: FloatArray, diameter: float, drag: float, friction: float
) -> FloatArray:
    """Drag of the air on straight round segments ``(E, 3)`` [N].

    With v_n and v_t the parts of the velocity relative to the air across and along the segment, l its
    length and d its diameter: the cross-flow principle with skin friction on the wetted surface (Morison et
    al. 1950; Hall and Goupee 2015, "Validation of a lumped-mass mooring line model", eqs. 12-13)::

        f = -1/2 rho d l [ C_D |v_n| v_n + pi C_f |v_t| v_t ]

    Args:
        segments: from end to end ``(E, 3)`` [m].
        relative: velocity of the segments relative to the air ``(E, 3)`` [m/s].
        diameter: d [m].
        drag: C_D, on the frontal area d l of the flow across [1].
        friction: C_f, on the wetted area pi d l of the flow along [1].
    """
    length = np.linalg.norm(segments, axis=1, keepdims=True)
    tangent = segments / np.maximum(length, 1e-300)
    along = np.sum(relative * tangent, axis=1, keepdims=True) * tangent
    across = relative - along
    fast_across, fast_along = (np.linalg.norm(v, axis=1, keepdims=True) for v in (across, along))
    pressure = -0.5 * AIR_DENSITY * diameter * length
    return np.asarray(pressure * (drag * fast_across * across + np.pi * friction * fast_along * along))
