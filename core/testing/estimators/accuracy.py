"""Known posteriors recovered: where they are, how wide, how often right, from weighted draws, and at the bounds."""

import numpy as np

from ...arrays import FloatArray
from ..checks import must
from .cases import Cloud, LinearGaussian, MakeEstimator
from .posterior import check_normalised, check_shapes_and_support


def check_linear_gaussian(
    make: MakeEstimator, draws: int = 400, mean_error: float = 0.6, spread: tuple[float, float] = (0.7, 1.6)
) -> None:
    """A known posterior is recovered in the inner region.

    Args:
        make: builds an estimator.
        draws: simulated draws to train on.
        mean_error: allowed root mean square error of the posterior mean, in exact standard deviations.
        spread: allowed ratio of the posterior's standard deviation to the exact one, on average.
    """
    case = LinearGaussian.make()
    theta, x = case.draws(draws, 2)
    estimator = make()
    estimator.fit(theta, x, seed=0)
    rng = np.random.default_rng(3)
    truth = 0.35 + 0.3 * rng.random((20, 2))
    errors, ratios, exact = [], [], np.sqrt(np.diag(case.covariance))
    for row in case.simulate(truth, rng):
        samples = estimator.posterior([row]).sample(2000, rng)
        errors.append((samples.mean(axis=0) - case.exact_mean(row)) / exact)
        ratios.append(samples.std(axis=0) / exact)
    error, ratio = np.sqrt(np.mean(np.square(errors), axis=0)), np.mean(ratios, axis=0)
    must((error < mean_error).all(), f"posterior means are {error.round(2)} exact standard deviations off (rms)")
    fits = (ratio > spread[0]) & (ratio < spread[1])
    must(fits.all(), f"posterior standard deviations are {ratio.round(2)} times the exact ones")


def check_calibrated(make: MakeEstimator, draws: int = 400, cases: int = 60, tolerance: float = 0.17) -> None:
    """Over fresh draws from the prior, central 80 % intervals hold the truth about 80 % of the time."""
    case = LinearGaussian.make()
    theta, x = case.draws(draws, 4)
    estimator = make()
    estimator.fit(theta, x, seed=0)
    truth, fresh = case.draws(cases, 5)
    rng = np.random.default_rng(6)
    ranks = [
        (estimator.posterior([row]).sample(400, rng) < t).mean(axis=0) for t, row in zip(truth, fresh[0], strict=True)
    ]
    held = np.mean((np.array(ranks) > 0.1) & (np.array(ranks) < 0.9), axis=0)
    must((np.abs(held - 0.8) < tolerance).all(), f"80 % intervals hold the truth in {(100 * held).round()} % of cases")


def _narrow(count: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Draws ``(N, 2)`` crowded about 0.7, a fifth of them from the prior, and log p/p~ ``(N,)``."""
    theta = 0.7 + 0.15 * rng.standard_normal((50 * count, 2))
    inside = ((theta > 0.0) & (theta < 1.0)).all(axis=1)
    crowded = theta[inside][:count]
    theta = np.where(rng.random((count, 1)) < 0.2, rng.random((count, 2)), crowded)
    density = np.exp(-0.5 * (((theta - 0.7) / 0.15) ** 2).sum(axis=1)) / (2 * np.pi * 0.15**2) / inside.mean()
    return theta, -np.log(0.2 + 0.8 * density)


def check_weights_honoured(make: MakeEstimator, draws: int = 600, tolerance: float = 0.35) -> None:
    """Draws from a known narrower proposal, with their weights, give the posterior that draws from the prior give.

    Args:
        make: builds an estimator.
        draws: simulated draws to train on.
        tolerance: of the mean error over measurements, in exact standard deviations; taking the proposal for the
            prior makes it 0.6.
    """
    case, points, rng = Cloud(), 4, np.random.default_rng(10)
    theta, log_weights = _narrow(draws, rng)
    estimator = make()
    estimator.fit(theta, [case.simulate(theta, points, rng)], log_weights=log_weights, seed=0)
    errors = []
    for row in case.simulate(0.35 + 0.3 * rng.random((40, 2)), points, rng):
        mean, sd = case.exact(row)
        errors.append((estimator.posterior([row]).sample(1000, rng).mean(axis=0) - mean) / sd)
    error = np.mean(errors, axis=0)
    must(
        (np.abs(error) < tolerance).all(),
        f"with draws crowded about 0.7 and their weights, posterior means lie {error.round(2)} exact standard "
        "deviations off, towards where the draws are",
    )


def check_at_bounds(make: MakeEstimator, draws: int = 300, tolerance: float = 2.0) -> None:
    """With the truth in a corner of the prior the posterior stays proper, and has its mass there.

    Args:
        make: builds an estimator.
        draws: simulated draws to train on.
        tolerance: of posterior means, in exact standard deviations (rms); at a bound a posterior twice as wide as the
            exact one is 1.3 off by that alone.
    """
    case, points, rng = Cloud(scatter=0.15), 4, np.random.default_rng(11)
    corners = np.array([[0.0, 1.0], [1.0, 0.0], [0.0, 0.0], [1.0, 1.0]])
    theta = rng.random((draws, 2))
    estimator = make()
    estimator.fit(theta, [case.simulate(theta, points, rng)], seed=0)
    errors = []
    for row in case.simulate(np.repeat(corners, 2, axis=0), points, rng):
        posterior = estimator.posterior([row])
        check_shapes_and_support(posterior, 2)
        check_normalised(posterior, 2)
        samples = posterior.sample(2000, rng)
        clipped = int(((samples == 0.0) | (samples == 1.0)).any(axis=1).sum())
        must(clipped < 20, f"{clipped} of 2000 samples lie exactly on a bound, as if they were clipped to it")
        mean, sd = case.exact(row)
        errors.append((samples.mean(axis=0) - mean) / sd)
    error = np.sqrt(np.mean(np.square(errors), axis=0))
    must(
        (error < tolerance).all(),
        f"with the truth in a corner of the prior, posterior means are {error.round(2)} exact standard deviations off",
    )


def check_size_of_sets(make: MakeEstimator, draws: int = 600, spread: tuple[float, float] = (0.6, 1.7)) -> None:
    """More points tell more: the posterior's width goes with one over the root of their number.

    Args:
        make: builds an estimator.
        draws: simulated draws to train on, with sets of 2 to 32 points.
        spread: allowed ratio of the posterior's standard deviation to the exact one, on average, for sets of 2 and
            of 32 points.
    """
    case, rng = Cloud(), np.random.default_rng(12)
    theta = rng.random((draws, 2))
    x = case.simulate(theta, 32, rng)
    counts = np.exp2(rng.uniform(1.0, 5.0, draws)).round()
    x[np.arange(32) >= counts[:, None, None]] = np.nan
    estimator = make()
    estimator.fit(theta, [x], seed=0)
    for points in (2, 32):
        ratios = []
        for row in case.simulate(0.35 + 0.3 * rng.random((20, 2)), points, rng):
            ratios.append(estimator.posterior([row]).sample(1000, rng).std(axis=0) / case.exact(row)[1])
        ratio = np.mean(ratios, axis=0)
        fits = (ratio > spread[0]) & (ratio < spread[1])
        must(fits.all(), f"for sets of {points} points, standard deviations are {ratio.round(2)} times the exact ones")
