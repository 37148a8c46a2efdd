"""Points at exactly zero: how many programs write one that was not seen."""

import numpy as np

from ..arrays import BoolArray, FloatArray

#: A step longer than this times nearly the longest of any point is a jump.
_JUMP = 3.0


def unseen_zeros(points: FloatArray, correspondence: bool) -> BoolArray:
    """Which observations ``(T, P)`` at exactly zero cannot be where the point was.

    A point that is followed cannot be that jumps to zero or back from there, against how points move; one that is there
    throughout may be held there. Of a cloud those cannot be that share the place in one frame.

    Args:
        points: ``(T, P, A)``, NaN where not seen.
        correspondence: whether point p is the same spot in every frame.
    """
    zero = np.asarray((points == 0.0).all(axis=2))
    if zero.all():
        return np.zeros_like(zero)
    if not correspondence:
        return np.asarray(zero & (zero.sum(axis=1, keepdims=True) > 1))
    seen = np.isfinite(points).all(axis=2) & ~zero
    steps = np.linalg.norm(np.diff(points, axis=0), axis=2)[seen[1:] & seen[:-1]]
    steps = steps[steps > 0.0]
    limit = _JUMP * float(np.quantile(steps, 0.99)) if len(steps) else 0.0
    for p in np.flatnonzero(zero.any(axis=0)):
        known, there = np.flatnonzero(seen[:, p]), np.flatnonzero(zero[:, p])
        after = np.searchsorted(known, there)
        for run in np.split(np.arange(len(there)), np.flatnonzero(np.diff(after)) + 1):
            k = int(after[run[0]])
            sides = [(known[j], there[run[e]]) for j, e in ((k - 1, 0), (k, -1)) if 0 <= j < len(known)]
            zero[there[run], p] = any(np.linalg.norm(points[a, p]) > limit * abs(a - b) for a, b in sides)
    return zero
