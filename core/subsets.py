"""A fixed number of points a frame from any number of them, evenly and without chance."""

from collections.abc import Sequence

import numpy as np

from .arrays import FloatArray, IntArray

#: Bits a coordinate of the curve has: cells along each axis are a power of two.
_BITS = 16


def even_subset(cells: IntArray, count: int) -> IntArray:
    """Numbers of ``count`` points, or of all where there are fewer, that cover evenly what all of them cover.

    Every n-th along a curve that fills space, so that each stands for as many of its neighbours.

    Args:
        cells: where the points are ``(N, A)``, whole numbers not below zero.
        count: how many are wanted.

    References:
        Morton, *A computer oriented geodetic data base*, 1966: the curve.
    """
    if len(cells) <= count:
        return np.arange(len(cells))
    key = np.zeros(len(cells), np.int64)
    for bit in range(_BITS):
        for axis in range(cells.shape[1]):
            key |= ((cells[:, axis].astype(np.int64) >> bit) & 1) << (bit * cells.shape[1] + axis)
    # of equal shares of the curve the middle ones
    place = ((np.arange(count) + 0.5) * len(cells) / count).astype(int)
    return np.sort(np.argsort(key, kind="stable")[place])


def thinned(places: FloatArray, voxel: float, count: int) -> FloatArray:
    """One of ``places (N, 3)`` in every voxel, the first of them, and of these at most ``count`` that cover evenly.

    Args:
        places: of a cloud [m].
        voxel: its side [m].
        count: how many are wanted.
    """
    if not len(places):
        return places
    cells = np.floor(places / voxel).astype(np.int64)
    cells -= cells.min(axis=0)
    _, first = np.unique(cells, axis=0, return_index=True)
    return places[first[even_subset(cells[first], count)]]


def outermost(points: FloatArray, count: int) -> IntArray:
    """Numbers of ``count`` of ``points (N, A)`` that lie farthest from each other, beginning with the outermost.

    References:
        Gonzalez, *Clustering to minimize the maximum intercluster distance*, 1985.
    """
    apart = np.linalg.norm(points - points.mean(axis=0), axis=1) if len(points) else np.zeros(0)
    chosen: list[int] = []
    for k in range(min(count, len(points))):
        chosen.append(int(np.argmax(apart)))
        last = np.linalg.norm(points - points[chosen[-1]], axis=1)
        apart = last if k == 0 else np.minimum(apart, last)
    return np.array(chosen, np.int64)


def stacked(frames: Sequence[FloatArray], count: int) -> FloatArray:
    """Points of every frame ``(n, A)``, n at most ``count``, as one array ``(T, count, A)`` filled up with NaN."""
    out = np.full((len(frames), count, frames[0].shape[1]), np.nan)
    for row, points in zip(out, frames, strict=True):
        row[: len(points)] = points
    return out
