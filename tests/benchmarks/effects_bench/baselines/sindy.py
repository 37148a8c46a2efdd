"""Sparse regression of the acceleration that the model lacks on what simple laws would add to it."""

import warnings

import numpy as np
from scipy.signal import savgol_filter

from muslin.core.arrays import FloatArray
from muslin.core.interpolation import interpolate
from muslin.core.measurement import Recording
from muslin.core.rollout import Trajectory
from muslin.core.study import Task

from .trial import Answer, Trial

#: Frames and degree of the smoothing polynomial.
WINDOW, DEGREE = 11, 3
#: Terms that carry less than this share of the residual acceleration are dropped, with this ridge.
THRESHOLD, RIDGE = 0.05, 0.05
#: Nearer than this to a table a point rubs on it [m].
NEAR = 0.01


def sindy(trial: Trial) -> Answer:
    """SINDy (Brunton, Proctor and Kutz 2016) on residuals; the term that carries most names the effect.

    Regressed is the measured acceleration of every marker less the fitted model's, both smoothed, on terms that stand
    for one effect each, standardised; with the sequentially thresholded least squares of PySINDy.
    """
    from pysindy import STLSQ

    space = trial.study.problem.space
    values = space.as_dict(space.from_unit(trial.unit))
    tasks = [Task(values, name) for name in trial.problem.fit_on]
    parts = []
    for name, outcome in zip(trial.problem.fit_on, trial.pool.map(tasks), strict=True):
        if isinstance(outcome, Trajectory):
            parts.append(_rows(trial, trial.problem.recordings[name], outcome))
    if not parts:
        return Answer(None)
    lacking = np.concatenate([y for y, _ in parts])
    terms = {k: np.concatenate([f[k] for _, f in parts]) for k in parts[0][1]}
    kept = {k: f for k, f in terms.items() if float(np.std(f)) > 1e-9 and k in trial.candidates}
    if not kept or float(np.std(lacking)) == 0.0:
        return Answer(None)
    matrix = np.stack([f / np.std(f) for f in kept.values()], axis=1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that no term is left is an answer
        found = STLSQ(threshold=THRESHOLD, alpha=RIDGE).fit(matrix, lacking[:, None] / np.std(lacking))
    sizes = np.abs(np.asarray(found.coef_).ravel())
    return Answer(list(kept)[int(np.argmax(sizes))] if sizes.max() > 0 else None)


def filled(points: FloatArray, times: FloatArray) -> FloatArray:
    """``points (T, P, 3)`` with what was not seen interpolated in time."""
    out = points.copy()
    for p in range(points.shape[1]):
        seen = np.isfinite(points[:, p, 0])
        if seen.any():
            out[:, p] = interpolate(times, times[seen], points[seen, p]) if seen.sum() > 1 else points[seen, p]
    return np.nan_to_num(out)


def _rows(trial: Trial, recording: Recording, model: Trajectory) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Residual acceleration ``(N,)`` and the terms ``(N,)`` each, of all frames, markers and axes."""
    times = recording.series.time
    step = float(np.median(np.diff(times)))

    def smooth(points: FloatArray, order: int) -> FloatArray:
        return np.asarray(savgol_filter(points, WINDOW, DEGREE, deriv=order, delta=step, axis=0))

    seen, hands = filled(recording.series.points, times), model.poses[:, 0, :3]
    where, speed = smooth(seen, 0), smooth(seen, 1)
    lacking = smooth(seen, 2) - smooth(model.series.points, 2)
    size = np.linalg.norm(speed, axis=2, keepdims=True)
    ones = np.ones_like(speed)
    side, jerk = ones * np.array([1.0, 0.5, 0.0]), smooth(model.series.points, 3)
    hand = np.broadcast_to(smooth(hands, 3)[:, None], speed.shape)
    rippling = speed - speed.mean(axis=1, keepdims=True)
    low = where[..., 2:] - where[..., 2].min() < NEAR
    drag = "cylinder-drag" if trial.study.problem.scenarios[recording.name].body.kind == "rope" else "air-drag"
    terms = {
        "viscous-damping": speed,
        drag: size * speed,
        "gravity-tilt": side,
        "wind": size * side,
        "internal-damping": np.gradient(np.gradient(rippling, axis=1), axis=1),
        "camera-latency": jerk,
        "actuator-lag": hand,
        "stick-slip": low * speed / np.maximum(size, 1e-6),
        "wet-patch": ones * np.array([0.0, 0.0, 1.0]),
    }
    return lacking.ravel(), {k: np.asarray(f).ravel() for k, f in terms.items()}
