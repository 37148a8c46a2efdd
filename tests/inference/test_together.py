"""How wide a posterior is where a model is wrong: as wide as its best fit varies, be the misfit short or lasting."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.measurement import Recording
from muslin.core.series import PointSeries
from muslin.inference.polish import PRIOR, Objective, Polished
from muslin.inference.residuals import Offsets
from muslin.inference.sequential.together import told_together

FRAMES, POINTS, TAKES, PARAMETERS = 120, 3, 2, 2
TIME = np.arange(FRAMES) / 30
ROWS = FRAMES * POINTS * 3
NONE = Offsets()


def objective(offsets: Offsets = NONE) -> Objective:
    names = [f"take {k}" for k in range(TAKES)]
    recordings = {n: Recording(n, PointSeries(TIME, np.zeros((FRAMES, POINTS, 3)))) for n in names}
    pool = SimpleNamespace(problem=SimpleNamespace(recordings=recordings))
    return cast(Objective, SimpleNamespace(recordings=names, pool=pool, offsets=offsets))


def sensitivity() -> FloatArray:
    """Slow, as what a stiffness does: ``(N, D)``."""
    rng = np.random.default_rng(7)
    phases = rng.uniform(0, 2 * np.pi, (TAKES, 1, POINTS * 3, PARAMETERS))
    waves = np.sin(2 * np.pi * 0.5 * TIME[None, :, None, None] * (1 + np.arange(PARAMETERS)) + phases)
    return np.asarray(60.0 * waves.reshape(-1, PARAMETERS))


def left_by(misfit: FloatArray) -> Polished:
    """The best fit of a linear model whose truth is 0.5, where so much ``(N,)`` is left there."""
    slope = sensitivity()
    step = -np.linalg.lstsq(slope, misfit, rcond=None)[0]
    covariance = np.linalg.inv(slope.T @ slope + PRIOR * np.eye(PARAMETERS))
    return Polished(0.5 + step, misfit + slope @ step, slope, covariance, float(len(misfit)))


def lasting(rng: np.random.Generator, correlation: float, sd: float) -> FloatArray:
    """AR(1) in time, shared by all points of a take."""
    out = np.zeros((TAKES, FRAMES, POINTS * 3))
    shocks = rng.normal(size=out.shape)
    for t in range(FRAMES):
        before = out[:, t - 1] if t else rng.normal(size=out[:, 0].shape)
        out[:, t] = correlation * before + np.sqrt(1 - correlation**2) * shocks[:, t]
    return sd * out.reshape(-1)


@pytest.mark.parametrize("correlation", [0.0, 0.95])
def test_best_fits_vary_by_what_they_are_told_to(correlation: float) -> None:
    """Squared errors over told variances, in the mean of 200 misfits."""
    errors, plain = [], []
    for seed in range(200):
        best = left_by(lasting(np.random.default_rng(seed), correlation, 3.0))
        told = told_together(objective(), best)
        errors.append((told.unit - 0.5) ** 2 / np.diag(told.widened))
        plain.append((told.unit - 0.5) ** 2 / np.diag(best.widened))
    assert 0.4 < np.mean(errors) < 1.3
    assert (np.mean(plain) > 3.0) == (correlation > 0.0)


def test_where_only_noise_is_left_nothing_changes() -> None:
    best = left_by(lasting(np.random.default_rng(0), 0.0, 1.0))
    assert told_together(objective(), best) is best


def test_what_does_nothing_is_as_unknown_as_before() -> None:
    best = left_by(lasting(np.random.default_rng(0), 0.9, 3.0))
    idle = Polished(best.unit, best.white, 0.0 * best.jacobian, np.eye(PARAMETERS) / PRIOR, best.count)
    assert told_together(objective(), idle) is idle


def test_luck_and_what_goes_together_are_not_counted_twice() -> None:
    best = told_together(objective(), left_by(lasting(np.random.default_rng(0), 0.95, 3.0)))
    lucky = Polished(best.unit, best.white, best.jacobian, 4.0 * best.covariance, best.count, grown=4.0)
    told = told_together(objective(), lucky)
    assert told.together == pytest.approx(best.together)
    np.testing.assert_allclose(np.diag(told.widened), np.diag(best.widened), rtol=0.02)


def test_numbers_of_offsets_are_no_frames() -> None:
    """Each recording has four more residuals, of its clock and of its place."""
    rng = np.random.default_rng(0)
    parts = lasting(rng, 0.95, 3.0).reshape(TAKES, ROWS)
    white = np.concatenate([parts, np.zeros((TAKES, 4))], axis=1).reshape(-1)
    slope = np.concatenate([sensitivity().reshape(TAKES, ROWS, -1), np.zeros((TAKES, 4, PARAMETERS))], axis=1)
    best = left_by(parts.reshape(-1))
    more = Polished(best.unit, white, slope.reshape(-1, PARAMETERS), best.covariance, best.count)
    fewer = Polished(best.unit, parts.reshape(-1), best.jacobian, best.covariance, best.count)
    told = told_together(objective(Offsets(0.1, 0.1)), more).together
    assert told == pytest.approx(told_together(objective(), fewer).together)
