"""Faults of a tracked grid: frames in which it is shorter than the cloth that it follows can be."""

import numpy as np

from ...core.arrays import BoolArray, FloatArray

#: A grid has lost its cloth where its rows or its columns are shorter than this share of what they are mostly [1]. A
#: cloth keeps its length however it moves; the polyline through its nodes comes this short only if all of the cloth is
#: bent to a radius of 0.64 of their spacing.
SHORTEST = 0.9


def lost_cloth(grid: FloatArray) -> BoolArray:
    """Frames ``(T,)`` in which a tracked grid ``(T, n, m, 3)`` is too short, along or across, to be the cloth.

    A tracker that loses sight of a part of a cloth squeezes its grid onto the rest. Nodes not seen, NaN, are passed
    over with the segments beside them.
    """
    short = np.zeros(len(grid), bool)
    for axis in (1, 2):
        segments = np.linalg.norm(np.diff(grid, axis=axis), axis=-1).reshape(len(grid), -1)
        usual = np.full(segments.shape[1], np.nan)
        seen = np.isfinite(segments)
        known = seen.any(axis=0)
        usual[known] = np.nanmedian(segments[:, known], axis=0)
        length = np.sum(np.where(seen, segments, 0.0), axis=1)
        short |= length < SHORTEST * np.sum(np.where(seen, usual, 0.0), axis=1)
    return short
