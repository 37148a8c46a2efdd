"""What an estimator is given: too little of it, none of it, more recordings than one, sets of every size."""

from collections.abc import Callable

import numpy as np

from ...arrays import FloatArray
from ...errors import InputError
from ..checks import must
from .cases import Cloud, LinearGaussian, MakeEstimator
from .posterior import check_shapes_and_support


def _refused(what: str, call: Callable[[], object]) -> None:
    try:
        call()
    except InputError:
        return
    except Exception as error:
        raise AssertionError(f"{what} raise {type(error).__name__} instead of InputError: {error}") from error
    raise AssertionError(f"{what} are accepted; raise InputError")


def check_too_few_draws(make: MakeEstimator) -> None:
    """Three draws raise InputError rather than give a posterior."""
    theta, x = LinearGaussian.make().draws(3, 1)
    _refused("three draws", lambda: make().fit(theta, x, seed=0))


def check_failed_draws(make: MakeEstimator) -> None:
    """Draws in which nothing was seen raise InputError."""
    theta, x = LinearGaussian.make().draws(40, 1)
    x[0][4:6] = np.nan
    _refused("all-NaN draws", lambda: make().fit(theta, x, seed=0))


def check_constant_summaries(make: MakeEstimator) -> None:
    """Draws that are all alike give a finite posterior about as wide as the prior."""
    theta, x = LinearGaussian.make().draws(60, 1)
    x = [np.repeat(x[0][:1], 60, axis=0)]
    estimator = make()
    estimator.fit(theta, x, seed=0)
    posterior = estimator.posterior([x[0][0]])
    check_shapes_and_support(posterior, 2)
    spread = posterior.sample(2000, np.random.default_rng(0)).std(axis=0)
    must(
        (spread > 0.15).all(),
        f"draws that tell nothing give standard deviations {spread.round(3)}; the prior has 0.289",
    )


def check_missing_points(make: MakeEstimator) -> None:
    """Points not seen (NaN), in draws and in the measurement, give a finite posterior."""
    theta, x = LinearGaussian.make().draws(60, 1)
    rng = np.random.default_rng(2)
    x[0][rng.random(x[0].shape[:3]) < 0.3] = np.nan
    x[0][:, 0, 0] = LinearGaussian.make().rest[0, 0]  # so that no draw is empty
    x[0][1, 2] = np.nan  # a frame without any point
    estimator = make()
    estimator.fit(theta, x, seed=0)
    for row in (x[0][0], x[0][1]):
        check_shapes_and_support(estimator.posterior([row]), 2)


def check_several_recordings(make: MakeEstimator, draws: int = 150) -> None:
    """Recordings that differ in frames and points are all read: each here tells one of the two parameters."""
    rng = np.random.default_rng(8)

    def recordings(theta: FloatArray) -> list[FloatArray]:
        shapes, noise = ((len(theta), 2, 3, 2), (len(theta), 3, 4, 2)), 0.05
        return [theta[:, k, None, None, None] + noise * rng.standard_normal(s) for k, s in enumerate(shapes)]

    theta = rng.random((draws, 2))
    estimator = make()
    estimator.fit(theta, recordings(theta), seed=0)
    truth = np.array([[0.3, 0.6]])
    x = [a[0] for a in recordings(truth)]
    posterior = estimator.posterior(x)
    check_shapes_and_support(posterior, 2)
    error = np.sqrt(np.mean((posterior.sample(2000, rng) - truth) ** 2, axis=0))
    must(
        (error < 0.15).all(),
        f"with each of two recordings telling a parameter, samples lie {error.round(2)} off the truth; one that "
        "reads only one of them has 0.3",
    )
    _refused("too few recordings in a measurement", lambda: estimator.posterior(x[:1]))


def check_varying_counts(make: MakeEstimator) -> None:
    """Sets of every size are read, also of fewer and of more points than there were in training."""
    case, rng = Cloud(), np.random.default_rng(9)
    theta = rng.random((60, 2))
    x = case.simulate(theta, 12, rng)
    x[np.arange(12) >= rng.integers(1, 13, 60)[:, None, None]] = np.nan
    estimator = make()
    estimator.fit(theta, [x], seed=0)
    for points in (1, 5, 12, 40):
        try:
            posterior = estimator.posterior([case.simulate(theta[:1], points, rng)[0]])
        except InputError as error:
            raise AssertionError(f"after sets of 1 to 12 points, one of {points} is refused: {error}") from error
        check_shapes_and_support(posterior, 2)
