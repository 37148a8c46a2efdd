"""Measured minus predicted, in units of the noise, with clock and constant offsets taken out."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..core.arrays import FloatArray
from ..core.interpolation import interpolate
from ..core.measurement import Recording
from ..core.series import PointSeries
from .noise import Noise

#: Gauss-Newton steps that find the offsets: where points correspond, and at most where each looks for its nearest.
_STEPS, _CLOSEST_STEPS = 4, 12
#: Keeps a frame without any error from dividing by it.
_TINY = 1e-24
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
        constant: offset of the measured points that was taken out ``(A,)`` [unit]; 0 where none was.
    """

    difference: FloatArray
    white: FloatArray
    clock: float = 0.0
    constant: FloatArray | float = 0.0

    def recorded(self, time: FloatArray, predicted: FloatArray) -> FloatArray:
        """Predicted points ``(T, ..., A)`` at ``time (T,)`` [s] when and where the recording would show them."""
        return self.late(time, predicted) + self.constant

    def late(self, time: FloatArray, predicted: FloatArray) -> FloatArray:
        """What is predicted ``(T, ...)`` at ``time (T,)`` [s], when the recording would show it."""
        return interpolate(time + self.clock, time, predicted)

    @property
    def rms(self) -> float:
        """Root mean square over all seen coordinates [unit]."""
        return rms(self.difference)

    @property
    def by_time(self) -> FloatArray:
        """The same of every frame ``(T,)``; NaN where nothing was seen."""
        return _rms(self.difference, (1, 2))

    @property
    def by_point(self) -> FloatArray:
        """The same of every point ``(P,)``; NaN where it was never seen."""
        return _rms(self.difference, (0, 2))


def rms(difference: FloatArray) -> float:
    """Root mean square of what was seen; NaN if nothing was."""
    return float(_rms(difference, tuple(range(difference.ndim))))


def _rms(difference: FloatArray, axes: tuple[int, ...]) -> FloatArray:
    seen = np.isfinite(difference)
    total = np.sum(np.where(seen, difference, 0.0) ** 2, axis=axes)
    count = seen.sum(axis=axes)
    return np.asarray(np.sqrt(np.where(count > 0, total / np.maximum(count, 1), np.nan)))


def residual(recording: Recording, predicted: PointSeries, noise: Noise, offsets: Offsets) -> Residual:
    """Compare, after the offsets most probable under their priors are taken out.

    Without correspondence each measured point is held against the nearest predicted one, which is looked for anew as
    the offsets become known (as iterative closest points do, Besl and McKay 1992).
    """
    measured, time = recording.series.points, recording.series.time
    paired = recording.series.correspondence
    if offsets.clock == 0.0 and offsets.constant == 0.0:
        difference = measured - (predicted.points if paired else nearest(measured, predicted.points)[0])
        return Residual(difference, _weighted(difference, noise))
    clock, constant = 0.0, np.zeros(measured.shape[2])
    least, best = np.inf, (clock, constant, measured)
    for _ in range(1 + (_STEPS if paired else _CLOSEST_STEPS)):
        shifted = interpolate(time + clock, time, predicted.points)
        slope = np.gradient(shifted, time, axis=0)
        if not paired:
            shifted, slope = nearest(measured - constant, shifted, slope)
        difference = measured - shifted - constant
        cost = _cost(difference, clock, constant, noise, offsets)
        if cost < least:
            least, best = cost, (clock, constant, difference)
        elif not paired:  # as near as the places let it come
            break
        step = _solve(*_rows(difference, slope, constant, paired), clock, noise, offsets)
        clock, constant = float(np.clip(clock + step[0], -4 * offsets.clock, 4 * offsets.clock)), step[1:]
    clock, constant, difference = best
    parts = [_weighted(difference, noise)]
    if offsets.clock > 0:
        parts.append(np.array([clock / offsets.clock]))
    if offsets.constant > 0:
        parts.append(constant / offsets.constant)
    return Residual(difference, np.concatenate(parts), clock, constant)


def rms_apart(pairs: Iterable[tuple[FloatArray, FloatArray]]) -> float:
    """Root mean square a coordinate between points of like shape, where both are seen [unit]; 0 where none are."""
    squares = np.concatenate([np.zeros(0), *(((a - b) ** 2).ravel() for a, b in pairs)])
    seen = squares[np.isfinite(squares)]
    return float(np.sqrt(seen.mean())) if len(seen) else 0.0


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


def _cost(difference: FloatArray, clock: float, constant: FloatArray, noise: Noise, offsets: Offsets) -> float:
    """Minus twice the log posterior of the offsets."""
    total = noise.information / noise.sd**2 * float(np.nansum(difference**2))
    total += (clock / offsets.clock) ** 2 if offsets.clock > 0 else 0.0
    return total + (float(np.sum(constant**2)) / offsets.constant**2 if offsets.constant > 0 else 0.0)


def _rows(
    difference: FloatArray, slope: FloatArray, constant: FloatArray, paired: bool
) -> tuple[FloatArray, FloatArray]:
    """What is seen of measured minus predicted ``(N,)``, and its derivatives by clock and constant ``(N, 1 + A)``.

    Where points correspond, of every coordinate. Where each is held against its nearest, of their distance: along the
    surface the nearest one follows, so only the way off it counts (as from point to plane, Chen and Medioni 1992).
    """
    axes = difference.shape[2]
    seen = np.isfinite(difference)
    if paired:
        design = np.concatenate([slope[..., None], np.broadcast_to(np.eye(axes), (*slope.shape, axes))], axis=3)
        return (difference + constant)[seen], design[seen]
    there = seen.all(axis=2)
    away = difference[there]
    distance = np.linalg.norm(away, axis=1)
    ray = away / np.where(distance > 0, distance, 1.0)[:, None]
    by_clock = np.sum(ray * slope[there], axis=1)
    return distance + ray @ constant, np.concatenate([by_clock[:, None], ray], axis=1)


def _solve(right: FloatArray, design: FloatArray, clock: float, noise: Noise, offsets: Offsets) -> FloatArray:
    """One Gauss-Newton step ``(1 + A,)`` of the clock, and the constant, with Gaussian priors of mean zero."""
    weight = noise.information / noise.sd**2
    prior = np.full(design.shape[1], 1 / offsets.constant**2 if offsets.constant > 0 else 1e30)
    prior[0] = 1 / offsets.clock**2 if offsets.clock > 0 else 1e30
    pull = weight * design.T @ right
    pull[0] -= clock * prior[0] if offsets.clock > 0 else 0.0
    return np.asarray(np.linalg.solve(weight * design.T @ design + np.diag(prior), pull))


def nearest(measured: FloatArray, model: FloatArray, *more: FloatArray) -> list[FloatArray]:
    """Of ``model (T, Q, A)`` the point nearest to each of ``measured (T, P, A)``, and what ``more`` says of it.

    Returns:
        ``(T, P, A)`` for ``model`` and each of ``more``; NaN where one of both points was not seen.
    """
    out = [np.full_like(measured, np.nan) for _ in range(1 + len(more))]
    for t, (points, predicted) in enumerate(zip(measured, model, strict=True)):
        seen, there = np.isfinite(points).all(axis=1), np.isfinite(predicted).all(axis=1)
        if seen.any() and there.any():
            near = np.flatnonzero(there)[cKDTree(predicted[there]).query(points[seen])[1]]
            for made, source in zip(out, (model, *more), strict=True):
                made[t, seen] = source[t, near]
    return out


def _weighted(difference: FloatArray, noise: Noise) -> FloatArray:
    """Seen differences over the noise, scaled so that their squares add up as fewer, independent ones would.

    Filtering them to innovations instead would weigh fast errors above slow ones, and a stiff model
    that hardly moves would beat the right one that swings slightly out of phase.

    With tails c, a frame whose n differences have the mean square q [noise variances] adds up to
    n log(1 + q / c^2) / log(1 + 1 / c^2): a Student t of all that a frame shows (Lange, Little and Taylor, *Robust
    statistical modeling using the t distribution*, 1989), scaled so that what is off as noise is counts as noise does.
    Small errors grow in what moves fast, until a whip or a twirl goes one way or the other, whatever the parameters;
    by squares one such take outweighs all that a model can follow.
    """
    if noise.tails is not None:
        q = np.nan_to_num(_rms(difference, (1, 2))) ** 2 / noise.sd**2
        counted = np.log1p(q / noise.tails**2) / np.log1p(1.0 / noise.tails**2)
        difference = difference * np.sqrt(counted / np.maximum(q, _TINY))[:, None, None]
    seen = difference[np.isfinite(difference)]
    return np.asarray(seen * (np.sqrt(noise.information) / noise.sd))
