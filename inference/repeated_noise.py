"""Noise from two takes of one motion, and whether they are."""

from dataclasses import dataclass

import numpy as np

from ..core.arrays import FloatArray
from ..core.interpolation import interpolate
from ..core.measurement import Recording
from ..core.motion import rotate

#: Largest clock offset between repeats that is looked for, this [s] or so many frames if they are longer.
_LARGEST_SHIFT, _LARGEST_SHIFT_FRAMES = 0.03, 3
#: No noise of repeats is taken to be more correlated from frame to frame.
SLOWEST = 0.98
#: Grippers may differ by this share of the variance of what points differ by, as what swings makes more of it, and by
#: as much as robots do [m]; where points are pixels by so much [m]. What differs more is another motion of that name.
_SHARE, _ROBOT, _SEEN_BY_A_CAMERA = 0.02, 2e-4, 1e-3
#: Turns of a gripper are told by how far they move what is so far beside it [m].
_BESIDE = 0.1


@dataclass(frozen=True)
class RepeatedNoise:
    """What two takes of one motion say.

    Args:
        variance: of one coordinate [unit2].
        ar1: correlation between successive frames.
        count: of numbers that told it.
        moved_alike: whether grippers moved the same way, as far as is known.
    """

    variance: float
    ar1: float
    count: int
    moved_alike: bool


def noise_of_repeats(a: Recording, b: Recording) -> RepeatedNoise | None:
    """From the difference of two repeats with corresponding points; None if they share too few frames.

    The clock offset between them and a constant offset are taken out. Between two frames, at the share
    f, interpolation averages noise: white noise of variance s^2 leaves (1 + f^2 + (1 - f)^2) s^2 in the
    difference, and a lag-one covariance of f (1 - f) s^2; both are allowed for, or half-frame shifts
    would look best and the noise too small.
    """
    time = a.series.time - a.series.time[0]
    other = b.series.time - b.series.time[0]
    largest = max(_LARGEST_SHIFT, _LARGEST_SHIFT_FRAMES * float(np.median(np.diff(time))))
    inside = (time >= largest) & (time <= other[-1] - largest)
    if inside.sum() < 8:
        return None
    best: tuple[float, FloatArray, float, FloatArray] | None = None
    for shift in np.linspace(-largest, largest, 61):
        when = time[inside] + shift
        d = a.series.points[inside] - interpolate(when, other, b.series.points)
        seen = np.isfinite(d)
        if seen.sum() < 8:
            continue
        d = np.where(seen, d, 0.0)
        d = np.where(seen, d - d.sum(axis=0) / np.maximum(seen.sum(axis=0), 1), np.nan)
        left = np.clip(np.searchsorted(other, when, side="right"), 1, len(other) - 1)
        f = np.clip((when - other[left - 1]) / (other[left] - other[left - 1]), 0, 1)
        mixing = float(np.mean(f * (1 - f)))
        lost = seen.shape[0] / max(seen.shape[0] - 1, 1)  # to the constant offset
        variance = float(np.nanmean(d**2)) * lost / (2 - 2 * mixing)
        if best is None or variance < best[0]:
            best = (variance, d, mixing, when)
    if best is None:
        return None
    variance, d, mixing, when = best
    both = np.isfinite(d[1:]) & np.isfinite(d[:-1])
    covariance = float(np.mean(d[1:][both] * d[:-1][both])) if both.any() else 0.0
    ar1 = (covariance / max(variance, 1e-300) - mixing) / 2
    if ar1 > 0:  # the constant takes more from slow noise: Kendall 1954, and the variance of the mean of an AR(1)
        frames = len(d)
        ar1 = min(ar1 + (1 + 3 * ar1) / frames, SLOWEST)
        variance /= lost * max(1 - (1 + ar1) / (1 - ar1) / frames, 0.5)
    alike = True
    if a.gripper is not None and b.gripper is not None and a.gripper.grippers == b.gripper.grippers:
        apart = _moved_apart(a.gripper.at(a.series.time[inside]), b.gripper.at(b.series.time[0] + when))
        alike = apart <= (max(_SHARE * variance, _ROBOT**2) if a.series.unit == "m" else _SEEN_BY_A_CAMERA**2)
    return RepeatedNoise(variance, ar1, int(np.isfinite(d).sum()), alike)


def _moved_apart(poses: FloatArray, others: FloatArray) -> float:
    """Half the mean square of what differs between grippers ``(T, G, 7)``, but a constant and their noise [m2].

    Of a gripper's place and of places beside it, which show how it turns. Noise is what frames do not share with the
    next but one; interpolation makes that of neighbours alike.
    """
    d = _places(poses) - _places(others)
    d -= d.mean(axis=0)
    return float(np.mean(d[2:] * d[:-2])) / 2


def _places(poses: FloatArray) -> FloatArray:
    """``(T, G, 4, 3)`` [m]."""
    beside = rotate(poses[:, :, None, 3:], np.concatenate([np.zeros((1, 3)), _BESIDE * np.eye(3)]))
    return np.asarray(poses[:, :, None, :3] + beside)
