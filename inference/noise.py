"""How noisy the measurement is: told, from repeats, or from its roughness in time."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..core.arrays import FloatArray
from ..core.errors import InputError
from ..core.measurement import Recording
from ..core.study import Problem

#: Largest clock offset between repeats that is looked for [s].
_LARGEST_SHIFT = 0.03


@dataclass(frozen=True)
class Noise:
    """Noise of one coordinate of one point.

    Args:
        sd: standard deviation [unit].
        ar1: correlation between successive frames, of an AR(1) process.
        source: how it was found.
        unit: "m" or "px".
        relative_error: of ``sd``, one standard deviation.
    """

    sd: float
    ar1: float
    source: str
    unit: str
    relative_error: float

    @property
    def information(self) -> float:
        """How many independent numbers one number of an AR(1) sequence is worth, for its mean."""
        return (1 - self.ar1) / (1 + self.ar1)

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def estimate_noise(problem: Problem, told: float | None) -> Noise:
    """The noise of a study's recordings.

    Told by the study, else from repeats of the same motion (their difference is pure noise, take to
    take variation of the object included), else from the fourth difference in time, to which a smooth
    motion gives next to nothing.

    Raises:
        InputError: recordings too short or too sparse for an estimate.
    """
    recordings = list(problem.recordings.values())
    unit = recordings[0].series.unit
    if told is not None:
        return Noise(told, 0.0, "given in the study", unit, 0.02)
    pairs = [
        (a, b)
        for i, a in enumerate(recordings)
        for b in recordings[i + 1 :]
        if a.motion == b.motion and a.load == b.load and a.series.correspondence
    ]
    if pairs:
        differences = [_difference(a, b) for a, b in pairs]
        sd = float(np.sqrt(np.nanmean(np.concatenate([d.ravel() ** 2 for d in differences])) / 2.0))
        ar1 = float(np.clip(np.mean([_lag_one(d) for d in differences]), 0.0, 0.98))
        count = sum(int(np.isfinite(d).sum()) for d in differences) * (1 - ar1) / (1 + ar1)
        return Noise(sd, ar1, f"{len(pairs)} pair(s) of repeats", unit, float(1 / np.sqrt(2 * max(count, 1.0))))
    roughness = np.concatenate([_fourth_difference(r) for r in recordings])
    if len(roughness) < 20:
        raise InputError(
            "the noise cannot be estimated from so few frames; give it in the study: [noise] sd = 0.003 (in metres)"
        )
    sd = float(1.4826 * np.median(np.abs(roughness)))
    if sd <= 0:
        raise InputError("the measurement has no noise at all; give a standard deviation: [noise] sd = 0.001")
    return Noise(sd, 0.0, "roughness in time", unit, float(1.2 / np.sqrt(len(roughness) / 2)))


def _fourth_difference(recording: Recording) -> FloatArray:
    """Standardised fourth differences: of white noise of standard deviation s they have that same one."""
    if not recording.series.correspondence:
        return np.zeros(0)
    d = np.diff(recording.series.points, n=4, axis=0) / np.sqrt(70.0)
    return np.asarray(d[np.isfinite(d)])


def _difference(a: Recording, b: Recording) -> FloatArray:
    """Difference of two repeats after the clock offset between them is taken out, constant offset too."""
    time = a.series.time - a.series.time[0]
    other = b.series.time - b.series.time[0]
    inside = time[(time > _LARGEST_SHIFT) & (time < other[-1] - _LARGEST_SHIFT)]
    pa = _at(inside, time, a.series.points)
    best, smallest = np.full_like(pa, np.nan), np.inf
    for shift in np.linspace(-_LARGEST_SHIFT, _LARGEST_SHIFT, 25):
        d = pa - _at(inside + shift, other, b.series.points)
        d = d - np.nanmean(d, axis=0)
        size = float(np.nanmean(d**2))
        if size < smallest:
            best, smallest = d, size
    return best


def _at(when: FloatArray, time: FloatArray, points: FloatArray) -> FloatArray:
    flat = points.reshape(len(points), -1)
    return np.stack([np.interp(when, time, column) for column in flat.T], axis=1).reshape(len(when), *points.shape[1:])


def _lag_one(d: FloatArray) -> float:
    both = np.isfinite(d[1:]) & np.isfinite(d[:-1])
    a, b = d[1:][both], d[:-1][both]
    return float(np.sum(a * b) / max(np.sqrt(np.sum(a**2) * np.sum(b**2)), 1e-300))
