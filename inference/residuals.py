"""Measured minus predicted, in units of the noise, with clock and constant offsets taken out."""

from dataclasses import dataclass

import numpy as np

from ..core.arrays import FloatArray
from ..core.interpolation import interpolate
from ..core.measurement import Recording
from ..core.series import PointSeries
from .noise import Noise

#: What a failed rollout counts as, in every residual [noise standard deviations].
FAILED = 100.0


@dataclass(frozen=True)
class Offsets:
    """Prior standard deviations of what may be off in a recording: clock [s], position [m]."""

    clock: float = 0.0
    constant: float = 0.0


@dataclass(frozen=True, eq=False)
class Residual:
    """One recording against one prediction.

    Args:
        difference: measured minus predicted ``(T, P, A)`` [unit], offsets taken out; NaN = not seen.
        white: the same in units of the noise ``(N,)``, see :func:`_weighted`, and one number for each
            offset under its prior; its sum of squares is minus twice the log posterior.
        clock: offset of the measurement's clock that was taken out [s].
    """

    difference: FloatArray
    white: FloatArray
    clock: float = 0.0

    @property
    def rms(self) -> float:
        """Root mean square over all seen coordinates [unit]."""
        return float(_rms(self.difference, (0, 1, 2)))

    @property
    def by_time(self) -> FloatArray:
        """The same of every frame ``(T,)``; NaN where nothing was seen."""
        return _rms(self.difference, (1, 2))

    @property
    def by_point(self) -> FloatArray:
        """The same of every point ``(P,)``; NaN where it was never seen."""
        return _rms(self.difference, (0, 2))


def _rms(difference: FloatArray, axes: tuple[int, ...]) -> FloatArray:
    seen = np.isfinite(difference)
    total = np.sum(np.where(seen, difference, 0.0) ** 2, axis=axes)
    count = seen.sum(axis=axes)
    return np.asarray(np.sqrt(np.where(count > 0, total / np.maximum(count, 1), np.nan)))


def residual(recording: Recording, predicted: PointSeries, noise: Noise, offsets: Offsets) -> Residual:
    """Compare, after the offsets most probable under their priors are taken out.

    Without correspondence each measured point is held against the nearest predicted one.
    """
    measured = recording.series.points
    model = predicted.points
    if not recording.series.correspondence:
        model = _nearest(measured, model)
    if offsets.clock == 0.0 and offsets.constant == 0.0:
        difference = measured - model
        return Residual(difference, _weighted(difference, noise))
    clock, constant = 0.0, np.zeros(measured.shape[2])
    time = recording.series.time
    for _ in range(4):
        shifted = interpolate(time + clock, time, model)
        slope = np.gradient(shifted, time, axis=0)
        clock_step, constant = _solve(measured - shifted, slope, clock, noise, offsets)
        clock = float(np.clip(clock + clock_step, -4 * offsets.clock, 4 * offsets.clock))
    difference = measured - interpolate(time + clock, time, model) - constant
    parts = [_weighted(difference, noise)]
    if offsets.clock > 0:
        parts.append(np.array([clock / offsets.clock]))
    if offsets.constant > 0:
        parts.append(constant / offsets.constant)
    return Residual(difference, np.concatenate(parts), clock)


def failed(recording: Recording, offsets: Offsets) -> FloatArray:
    """White residuals that stand for a rollout that failed, of the usual length."""
    seen = int(np.isfinite(recording.series.points).sum())
    axes = recording.series.points.shape[2]
    return np.full(seen + (offsets.clock > 0) + axes * (offsets.constant > 0), FAILED)


def by_residual(recording: Recording, offsets: Offsets, by_frame: FloatArray) -> FloatArray:
    """Numbers of every frame ``(T,)``, repeated for its white residuals ``(N,)``; zero for the offsets' own."""
    points = recording.series.points
    seen = np.broadcast_to(by_frame[:, None, None], points.shape)[np.isfinite(points)]
    return np.concatenate([seen, np.zeros(len(failed(recording, offsets)) - len(seen))])


def _solve(
    difference: FloatArray, slope: FloatArray, clock: float, noise: Noise, offsets: Offsets
) -> tuple[float, FloatArray]:
    """One Gauss-Newton step for the clock and the constant offset, with Gaussian priors of mean zero."""
    axes = difference.shape[2]
    seen = np.isfinite(difference)
    d = np.where(seen, difference, 0.0)
    s = np.where(seen, slope, 0.0)
    weight = noise.information / noise.sd**2
    normal = np.zeros((1 + axes, 1 + axes))
    right = np.zeros(1 + axes)
    normal[0, 0] = weight * np.sum(s * s) + (1 / offsets.clock**2 if offsets.clock > 0 else 1e30)
    right[0] = weight * np.sum(s * d) - (clock / offsets.clock**2 if offsets.clock > 0 else 0.0)
    for a in range(axes):
        normal[0, 1 + a] = normal[1 + a, 0] = weight * np.sum(s[..., a])
        normal[1 + a, 1 + a] = weight * np.sum(seen[..., a]) + (
            1 / offsets.constant**2 if offsets.constant > 0 else 1e30
        )
        right[1 + a] = weight * np.sum(d[..., a])
    solved = np.linalg.solve(normal, right)
    return float(solved[0]), solved[1:]


def _nearest(measured: FloatArray, model: FloatArray) -> FloatArray:
    out = np.full_like(measured, np.nan)
    for t in range(len(measured)):
        gaps = np.linalg.norm(measured[t, :, None] - model[t, None], axis=-1)
        out[t] = model[t, np.argmin(np.where(np.isfinite(gaps), gaps, np.inf), axis=1)]
    return out


def _weighted(difference: FloatArray, noise: Noise) -> FloatArray:
    """Seen differences over the noise, scaled so that their squares add up as fewer, independent ones would.

    Filtering them to innovations instead would weigh fast errors above slow ones, and a stiff model
    that hardly moves would beat the right one that swings slightly out of phase.
    """
    seen = difference[np.isfinite(difference)]
    return np.asarray(seen * (np.sqrt(noise.information) / noise.sd))
