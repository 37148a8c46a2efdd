"""Noise that neighbouring points of a cloud share, told from what a fit leaves.

Depth cameras that do not agree with each other, or with the robot, move whole patches of a cloud, and leave them moved
for as long as the object is there. Counted as if each were off by itself, hundreds of points a frame would say far more
than they do, and what the cameras do would pass for the material's doing. How large the noise is no cloud tells, as
what a model misses looks the same. But how much a patch scatters about a plane shows how far points are off by
themselves: where that is less than the noise that a person has told would make it, neighbours share the rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.distance import cdist

from ..core.arrays import BoolArray, FloatArray, IntArray
from .noise import Noise, SharedNoise
from .patches import scatter, some_frames

#: Points of a frame that are looked at, at most.
_POINTS = 400
#: Pairs of points are sorted by distance into so many classes, up to this part of the cloud's extent; so many pairs a
#: class needs before it says anything.
_CLASSES, _FARTHEST, _PAIRS = 30, 0.6, 200
#: Correlation from frame to frame, at most; and the share of the noise below which nothing is called shared.
_SLOWEST, _LEAST = 0.98, 0.2


@dataclass(frozen=True, eq=False)
class Cloud:
    """One recording and what the best fit leaves of it.

    Args:
        points: as measured ``(T, P, A)`` [unit]; NaN = not seen.
        off: measured minus the nearest place of the model, offsets taken out ``(T, P, A)`` [unit].
    """

    points: FloatArray
    off: FloatArray


def cloud_noise(noise: Noise, clouds: Sequence[Cloud]) -> Noise:
    """``noise``, with what neighbours share of it if they do.

    Args:
        noise: as it was told.
        clouds: recordings without correspondence, at least one.
    """
    rng = np.random.default_rng(71)
    width = _FARTHEST * float(np.median([_extent(c.points) for c in clouds])) / _CLASSES
    same, next_to = (_alike(clouds, width, lag) for lag in (0, 1))
    if not same.known[0]:
        return noise
    # what is shared is seen across the surface alone, one of the coordinates, as the nearest place follows along it
    seen = clouds[0].off.shape[2] * same.product[0] / noise.sd**2
    points = [c.points for c in clouds]
    alone = scatter(points, noise.sd, rng)
    share = float(min(1.0 - scatter(points) / alone, seen)) if alone > 0.0 else 0.0
    if share < _LEAST:
        return noise
    reach = same.reach(width)
    near = same.known & next_to.known & (np.arange(_CLASSES) * width < reach)
    ar1 = float(np.clip(next_to.product[near].sum() / same.product[near].sum(), 0.0, _SLOWEST)) if near.any() else 0.0
    numbers, independent = (sum(x) for x in zip(*(_worth(c.points, share, reach, ar1) for c in clouds), strict=True))
    source = f"{noise.source}, of which neighbours share {100 * share:.0f} % over {reach:.2g} {noise.unit}"
    return replace(noise, shared=SharedNoise(share, reach, ar1, numbers / independent), source=source)


@dataclass(frozen=True, eq=False)
class _Alike:
    """Mean product of what two points are off by, a coordinate, in classes of their distance ``(C,)`` [unit2]."""

    product: FloatArray
    known: BoolArray

    def reach(self, width: float) -> float:
        """Of a Gaussian correlation: its distance squared is the integral of distance times correlation."""
        ends = np.flatnonzero(~self.known | (self.product <= 0.0))
        upto = int(ends[0]) if len(ends) else len(self.product)
        distance = (np.arange(upto) + 0.5) * width
        return float(np.sqrt(np.sum(distance * self.product[:upto] / self.product[0]) * width))


def _alike(clouds: Sequence[Cloud], width: float, lag: int) -> _Alike:
    """Of points of one frame, or of one and the ``lag``-th after it."""
    total, pairs = np.zeros(_CLASSES), np.zeros(_CLASSES)
    for cloud in clouds:
        for t in some_frames(len(cloud.off) - lag):
            here, there = _some(cloud.off[t]), _some(cloud.off[t + lag])
            if not len(here) or not len(there):
                continue
            apart = cdist(cloud.points[t, here], cloud.points[t + lag, there]) / width
            product = cloud.off[t, here] @ cloud.off[t + lag, there].T / cloud.off.shape[2]
            counts = apart < _CLASSES
            if lag == 0:
                np.fill_diagonal(counts, False)
            kind = apart[counts].astype(int)
            total += np.bincount(kind, product[counts], _CLASSES)
            pairs += np.bincount(kind, minlength=_CLASSES)
    return _Alike(total / np.maximum(pairs, 1.0), pairs >= _PAIRS)


def _some(places: FloatArray) -> IntArray:
    """Numbers of points that were seen, some of them if there are many."""
    seen = np.flatnonzero(np.isfinite(places).all(axis=1))
    return seen[:: max(1, -(-len(seen) // _POINTS))]


def _extent(points: FloatArray) -> float:
    """How far a cloud reaches, in the median over its frames [unit]."""
    seen = (p[np.isfinite(p).all(axis=1)] for p in points)
    return float(np.median([np.ptp(p, axis=0).max() for p in seen if len(p)] or [0.0]))


def _worth(points: FloatArray, share: float, reach: float, ar1: float) -> tuple[float, float]:
    """How many numbers of a coordinate there are, and how many independent ones their mean is worth."""
    counts, within = [], []
    for frame in points:
        some = frame[_some(frame)]
        if len(some):
            counts.append(int(np.isfinite(frame).all(axis=1).sum()))
            within.append(float(np.mean(np.exp(-(cdist(some, some) ** 2) / (2.0 * reach**2)))))
    numbers = float(sum(counts))
    apart = np.abs(np.subtract.outer(np.arange(len(counts)), np.arange(len(counts))))
    variance = share * float(np.mean(within)) * float(np.mean(ar1**apart)) + (1.0 - share) / numbers
    return numbers, 1.0 / variance
