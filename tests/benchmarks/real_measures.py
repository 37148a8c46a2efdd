"""How far a study of real recordings is off on those it was not fitted to, in several measures."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import zarr
from scipy.spatial import cKDTree

from muslin.core.arrays import BoolArray, FloatArray
from muslin.core.errors import RolloutFailed
from muslin.core.store import read
from muslin.core.study import Problem, Study, build_problem
from muslin.inference.criticism.comparing.surface import surface_lattice
from muslin.inference.sequential.result import load_fit

#: Of the bootstrap: how many times, and frames that stay together because errors of neighbours are alike [s].
_RESAMPLES, _BLOCK = 2000, 1.0
#: Quantile of the normal distribution that leaves 5 % on either side.
_QUANTILE_95 = 1.6449


def fitted_takes(study: Study) -> list[str]:
    """Names of the recordings that a study fits, whole or in pieces."""
    return list(study.config.study.fit_on or study.problem.fit_on)


def absolute(problem: Problem, values: Mapping[str, float]) -> dict[str, Any]:
    """Errors [m] on the held-out takes of ``problem``, no offset taken out.

    Of a point, the median; of a coordinate, the mean absolute one, and ``median_take`` the median of that over takes.
    ``failed`` says how many takes could not be simulated; all are NaN where none could.
    """
    off, failed = [], 0
    for name in problem.hold_out:
        try:
            simulated = problem.simulate(values, name).series.points
        except RolloutFailed:
            failed += 1
            continue
        difference = simulated - problem.recordings[name].series.points
        off.append(difference[np.isfinite(difference).all(axis=2)])
    if not off:
        return {"takes": 0, "failed": failed} | dict.fromkeys(
            ("median_point", "mean_coordinate", "median_take"), np.nan
        )
    every = np.concatenate(off)
    return {
        "takes": len(off),
        "failed": failed,
        "median_point": float(np.median(np.linalg.norm(every, axis=1))),
        "mean_coordinate": float(np.mean(np.abs(every))),
        "median_take": float(np.median([np.mean(np.abs(o)) for o in off])),
    }


def measures(study: Study) -> dict[str, Any]:
    """What a compared study is off on its held-out takes, clock and constant offsets taken out.

    ``coverage`` is the share of coordinates within the 90 % interval of the posterior prediction, ``mean_point`` the
    mean distance of a point [m] with a 95 % bootstrap interval, ``largest`` that of the frame where it is largest, and
    of a cloth whose every vertex is seen ``mean_surface`` the mean distance to the nearest place on it: what is left
    where points have slid along the cloth.
    """
    compared, noise = study.step_results("compare"), load_fit(study).noise.sd
    inside, distances, surfaces, times = [], [], [], []
    for name in study.problem.hold_out:
        group = compared[name]
        assert isinstance(group, zarr.Group)
        difference, draws = np.asarray(read(group, "difference"), float), np.asarray(read(group, "draws"), float)
        inside.append(within(difference, draws, noise))
        seen = np.isfinite(difference)
        away = np.sqrt(np.sum(np.where(seen, difference, 0.0) ** 2, axis=2))
        distances.append(np.where(seen.any(axis=2), away, np.nan))  # of balls only the height is seen
        times.append(np.asarray(read(group, "time"), float))
        scenario = study.problem.scenarios[name]
        if scenario.body.kind == "cloth" and scenario.unit == "m" and not scenario.sampled:
            lattice = surface_lattice(scenario)
            if lattice is not None:
                points = difference + np.asarray(read(group, "predicted"), float)
                surfaces.append(to_surface(points, [lattice @ v for v in np.asarray(read(group, "vertices"), float)]))
    by_frame = [np.nanmean(d[np.isfinite(d).any(axis=1)], axis=1).max() for d in distances]
    return {
        "coverage": float(np.mean(np.concatenate(inside))),
        "mean_point": float(np.mean(np.concatenate([d[np.isfinite(d)] for d in distances]))),
        "mean_point_interval": bootstrap(distances, times),
        "largest": float(max(by_frame)),
        **({"mean_surface": float(np.mean(np.concatenate(surfaces)))} if surfaces else {}),
    }


def within(difference: FloatArray, draws: FloatArray, noise: float) -> BoolArray:
    """Whether each number seen of ``difference (T, P, A)`` lies in the 90 % interval of the posterior prediction.

    That is the interval of a normal distribution about the best fit, with the scatter of the predictions of posterior
    draws ``(K, T, Q, A)`` and the noise. Of clouds, whose points have no scatter of their own, the mean one is taken.
    """
    scatter = draws.std(axis=0, ddof=1)
    if scatter.shape != difference.shape:
        scatter = np.full(difference.shape, np.sqrt(np.mean(scatter**2)))
    seen = np.isfinite(difference)
    return np.asarray(np.abs(difference[seen]) <= _QUANTILE_95 * np.hypot(scatter[seen], noise))


def to_surface(measured: FloatArray, places: Sequence[FloatArray]) -> FloatArray:
    """Distances ``(N,)`` of the points seen of ``measured (T, P, 3)`` to the nearest of a frame's places ``(L, 3)``."""
    seen = np.isfinite(measured).all(axis=2)
    found = [cKDTree(there).query(points[ok])[0] for points, ok, there in zip(measured, seen, places, strict=True)]
    return np.concatenate(found)


def bootstrap(distances: Sequence[FloatArray], times: Sequence[FloatArray]) -> list[float]:
    """95 % interval of the mean error of a point, from takes drawn anew and blocks of a second drawn anew in each.

    Args:
        distances: ``(T, P)`` a take, NaN where a point was not seen.
        times: ``(T,)`` a take [s].
    """
    rng = np.random.default_rng(17)
    blocks = [_sums(d, t) for d, t in zip(distances, times, strict=True)]
    means = []
    for _ in range(_RESAMPLES):
        drawn = [blocks[k] for k in rng.integers(len(blocks), size=len(blocks))]
        total, count = np.sum([b[rng.integers(len(b), size=len(b))].sum(axis=0) for b in drawn], axis=0)
        means.append(total / count)
    return [float(q) for q in np.quantile(means, [0.025, 0.975])]


def _sums(distance: FloatArray, time: FloatArray) -> FloatArray:
    """Sum and number of the errors of every block ``(B, 2)``."""
    block = ((time - time[0]) / _BLOCK).astype(int)
    rows = [distance[block == b] for b in np.unique(block)]
    sums = np.array([[np.nansum(r), np.isfinite(r).sum()] for r in rows], float)
    return np.asarray(sums[sums[:, 1] > 0])


def never_used(study: Study) -> Problem | None:
    """Of the takes that are in the measurement and neither fitted nor held out, as held-out ones; None without any."""
    known = {*fitted_takes(study), *study.problem.hold_out}
    left = [n for n in study.measurement.names if n not in known]
    if not left:
        return None
    config = study.config.model_copy(deep=True)
    config.study.hold_out = left
    return build_problem(config, study.measurement, study.path.parent)


def open_loop(states: Mapping[str, tuple[Study, Mapping[str, float]]]) -> dict[str, Any]:
    """:func:`absolute` of every state (a study and the values of its parameters), also on takes never used."""
    out = {}
    for state, (study, values) in states.items():
        for which, problem in {"open loop": study.problem, "never used": never_used(study)}.items():
            if problem is not None:
                out[f"{state} {which}"] = absolute(problem, values)
    return out
