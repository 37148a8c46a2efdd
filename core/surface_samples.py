"""Places spread evenly over an object, in proportion to its area or length, without chance."""

import numpy as np

from .arrays import FloatArray, IntArray
from .body import Body


def spread_over(corners: FloatArray, count: int) -> tuple[IntArray, FloatArray, FloatArray]:
    """``count`` places on triangles, as many on each as its area asks for.

    Args:
        corners: of the triangles ``(F, 3, 3)`` [m].
        count: how many.

    Returns:
        The triangle of each place ``(count,)``, and how far it goes along the first and the second edge from its first
        corner, ``(count,)`` each, as shares of them.

    References:
        Roberts, *The unreasonable effectiveness of quasirandom sequences*, 2018: the low-discrepancy sequence, folded
        into the triangle.
    """
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    which = np.searchsorted(np.cumsum(area) / area.sum(), (np.arange(count) + 0.5) / count)
    a, b = (0.5 + np.arange(count)[:, None] * [0.7548776662466927, 0.5698402909980532]).T % 1.0
    a, b = np.where(a + b > 1.0, 1.0 - a, a), np.where(a + b > 1.0, 1.0 - b, b)
    return which, a, b


def surface_weights(body: Body, count: int) -> FloatArray:
    """Weights ``(count, V)`` of the vertices that give places spread over a sheet, the skin of a solid, or a rope."""
    weights = np.zeros((count, len(body.vertices)))
    row = np.arange(count)
    if body.kind == "rope":
        ends = np.cumsum(body.measures)
        along = (row + 0.5) / count * ends[-1]
        which = np.searchsorted(ends, along)
        share = 1.0 - (ends[which] - along) / body.measures[which]
        first, last = body.elements[which].T
        weights[row, first], weights[row, last] = 1.0 - share, share
        return weights
    which, a, b = spread_over(body.vertices[body.triangles], count)
    for corner, share in zip(body.triangles[which].T, (1.0 - a - b, a, b), strict=True):
        weights[row, corner] = share
    return weights
