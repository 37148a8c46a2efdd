"""Conformance kit for posterior estimators: small checks that raise AssertionError, with numpy alone.

Example:
    >>> from muslin.core.testing.estimators import check_estimator  # doctest: +SKIP
    >>> check_estimator(MyEstimator, ordered=False)                 # doctest: +SKIP
"""

import math
import random
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..arrays import FloatArray
from ..errors import InputError
from ..estimator import Posterior, PosteriorEstimator

MakeEstimator = Callable[[], PosteriorEstimator]

_FRAMES, _POINTS, _AXES = 4, 5, 2


@dataclass(frozen=True, eq=False)
class LinearGaussian:
    """Points that move linearly with two parameters under white noise; the posterior is known.

    ``x = rest + J u + e``, ``e ~ N(0, noise^2)``, prior uniform on the unit square. In the inner region the bounds
    cut nothing off, so the posterior is Gaussian with covariance ``noise^2 (J^T J)^-1``, set here to standard
    deviations of 0.05 and 0.1 with correlation 0.5.
    """

    jacobian: FloatArray
    rest: FloatArray
    noise: float
    covariance: FloatArray

    @classmethod
    def make(cls, seed: int = 7) -> "LinearGaussian":
        rng = np.random.default_rng(seed)
        noise = 0.02
        covariance = np.array([[0.05**2, 0.5 * 0.05 * 0.1], [0.5 * 0.05 * 0.1, 0.1**2]])
        basis, _ = np.linalg.qr(rng.standard_normal((_FRAMES * _POINTS * _AXES, 2)))
        jacobian = noise * basis @ np.linalg.cholesky(np.linalg.inv(covariance)).T
        spot = np.stack([np.arange(_POINTS) * 0.5, np.arange(_POINTS) % 2 * 0.5], axis=1)
        return cls(jacobian, np.broadcast_to(spot, (_FRAMES, _POINTS, _AXES)).copy(), noise, covariance)

    def simulate(self, theta: FloatArray, rng: np.random.Generator) -> FloatArray:
        """``(N, 2)`` parameters to ``(N, T, P, A)`` points."""
        shift = (theta @ self.jacobian.T).reshape(len(theta), *self.rest.shape)
        return np.asarray(self.rest + shift + self.noise * rng.standard_normal(shift.shape))

    def draws(self, count: int, seed: int) -> tuple[FloatArray, list[FloatArray]]:
        """Draws from the prior."""
        rng = np.random.default_rng(seed)
        theta = rng.random((count, 2))
        return theta, [self.simulate(theta, rng)]

    def exact_mean(self, x: FloatArray) -> FloatArray:
        """``(2,)`` posterior mean where the bounds cut nothing off: the least-squares estimate."""
        return np.asarray(np.linalg.lstsq(self.jacobian, (x - self.rest).ravel(), rcond=None)[0])


def _fitted(make: MakeEstimator, count: int = 60, seed: int = 0) -> tuple[PosteriorEstimator, list[FloatArray]]:
    theta, x = LinearGaussian.make().draws(count, 1)
    estimator = make()
    estimator.fit(theta, x, seed=seed)
    return estimator, [a[0] for a in x]


def _same(a: Posterior, b: Posterior) -> bool:
    grid = np.random.default_rng(5).random((50, 2))
    first, second = a.sample(20, np.random.default_rng(6)), b.sample(20, np.random.default_rng(6))
    return np.array_equal(a.log_prob(grid), b.log_prob(grid)) and np.array_equal(first, second)


def _global_state() -> list[object]:
    state = cast(tuple[Any, ...], np.random.get_state(legacy=True))  # noqa: NPY002
    return [np.asarray(part).tolist() for part in state]


def check_shapes_and_support(posterior: Posterior, dim: int) -> None:
    """Samples are ``(N, D)`` inside the cube; ``log_prob`` is ``(N,)``, finite inside and -inf outside."""
    draws = posterior.sample(500, np.random.default_rng(0))
    assert draws.shape == (500, dim), f"sample(500) has shape {draws.shape}, not (500, {dim})"
    assert np.isfinite(draws).all(), "samples are not all finite"
    outside = int(((draws < 0) | (draws > 1)).any(axis=1).sum())
    assert outside == 0, f"{outside} of 500 samples lie outside the unit cube"
    log_p = posterior.log_prob(draws)
    assert log_p.shape == (500,), f"log_prob of 500 points has shape {log_p.shape}, not (500,)"
    assert np.isfinite(log_p).all(), "log_prob of the posterior's own samples is not finite"
    far = posterior.log_prob(np.full((1, dim), 0.5) + np.array([1.0] + [0.0] * (dim - 1)))
    assert far[0] == -np.inf, f"log_prob outside the unit cube is {far[0]:g}, not -inf"


def check_normalised(posterior: Posterior, dim: int, tolerance: float = 0.05, count: int = 100_000) -> None:
    """``exp(log_prob)`` integrates to one over the cube, by importance sampling.

    Half the points are uniform and half cluster about the posterior's samples (a widened
    normal, cut to the cube), so that sharp posteriors are integrated as well as flat ones.
    """
    rng = np.random.default_rng(0)
    draws = posterior.sample(2000, rng)
    center, spread = draws.mean(axis=0), 1.5 * draws.std(axis=0) + 1e-9
    clustered = center + spread * rng.standard_normal((count // 2, dim))
    points = np.concatenate([rng.random((count // 2, dim)), clustered])
    inside = ((points >= 0) & (points <= 1)).all(axis=1)
    normal = (
        -0.5 * (((points - center) / spread) ** 2).sum(axis=1) - np.log(spread).sum() - dim / 2 * math.log(2 * np.pi)
    )
    proposal = 0.5 * inside + 0.5 * np.exp(normal)
    total = float(np.sum(np.exp(posterior.log_prob(points[inside])) / proposal[inside]) / len(points))
    assert abs(total - 1) < tolerance, f"exp(log_prob) integrates to {total:.3f} over the unit cube, not to 1"


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
    assert (error < mean_error).all(), f"posterior means are {error.round(2)} exact standard deviations off (rms)"
    fits = (ratio > spread[0]) & (ratio < spread[1])
    assert fits.all(), f"posterior standard deviations are {ratio.round(2)} times the exact ones"


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
    assert (np.abs(held - 0.8) < tolerance).all(), f"80 % intervals hold the truth in {(100 * held).round()} % of cases"


def check_permutation_invariant(make: MakeEstimator) -> None:
    """The order of the points of each frame has no influence, neither in training nor in the measurement."""
    theta, x = LinearGaussian.make().draws(60, 1)
    rng = np.random.default_rng(2)
    order = rng.random(x[0].shape[:3]).argsort(axis=2)[..., None]
    shuffled = [np.take_along_axis(x[0], order, axis=2)]
    first, second = make(), make()
    first.fit(theta, x, seed=0)
    second.fit(theta, shuffled, seed=0)
    grid = rng.random((50, 2))
    reference = first.posterior([x[0][0]]).log_prob(grid)
    for estimator, row, when in ((first, shuffled[0][0], "the measurement"), (second, x[0][0], "the training draws")):
        gap = float(np.abs(estimator.posterior([row]).log_prob(grid) - reference).max())
        assert gap < 1e-6, f"permuting the points of {when} changes log_prob by up to {gap:.2g}"


def check_deterministic(make: MakeEstimator) -> None:
    """The same draws and seed give the same posterior to the bit; fitting again replaces the last fit."""
    a, row = _fitted(make)
    b, _ = _fitted(make)
    reference = a.posterior(row)
    assert _same(reference, b.posterior(row)), "two fits with the same draws and seed differ"
    theta, x = LinearGaussian.make().draws(60, 1)
    a.fit(theta, x, seed=0)
    assert _same(reference, a.posterior(row)), "a second fit on the same object is not the same as the first"
    assert _same(reference, a.posterior(row)), "asking for the posterior twice gives different ones"


def check_global_random_state(make: MakeEstimator) -> None:
    """Fitting and asking for a posterior leave the global generators of numpy and random alone."""
    before, python = _global_state(), random.getstate()
    estimator, row = _fitted(make)
    estimator.posterior(row).sample(5, np.random.default_rng(0))
    assert _global_state() == before, "numpy's global random state was changed; use the seed in a Generator of your own"
    assert random.getstate() == python, "the random module's global state was changed"


def check_save_and_load(posterior: Posterior) -> None:
    """A saved posterior comes back the same to the bit, under exactly the name given, and holds no pickle."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "posterior.npz"
        posterior.save(path)
        assert path.is_file(), "save wrote no file under the name that was given"
        assert path.read_bytes()[:1] != b"\x80", "the saved file is a pickle"
        assert _same(posterior, type(posterior).load(path)), "the posterior changed between save and load"


def check_too_few_draws(make: MakeEstimator) -> None:
    """Three draws raise InputError rather than give a posterior."""
    theta, x = LinearGaussian.make().draws(3, 1)
    try:
        make().fit(theta, x, seed=0)
    except InputError:
        return
    except Exception as error:
        raise AssertionError(f"three draws raise {type(error).__name__} instead of InputError: {error}") from error
    raise AssertionError("three draws are accepted; raise InputError")


def check_failed_draws(make: MakeEstimator) -> None:
    """A draw in which nothing was seen raises InputError."""
    theta, x = LinearGaussian.make().draws(40, 1)
    x[0][4] = np.nan
    try:
        make().fit(theta, x, seed=0)
    except InputError:
        return
    except Exception as error:
        raise AssertionError(f"an all-NaN draw raises {type(error).__name__} instead of InputError: {error}") from error
    raise AssertionError("an all-NaN draw is accepted; raise InputError")


def check_constant_summaries(make: MakeEstimator) -> None:
    """Draws that are all alike give a finite posterior about as wide as the prior."""
    theta, x = LinearGaussian.make().draws(60, 1)
    x = [np.repeat(x[0][:1], 60, axis=0)]
    estimator = make()
    estimator.fit(theta, x, seed=0)
    posterior = estimator.posterior([x[0][0]])
    check_shapes_and_support(posterior, 2)
    spread = posterior.sample(2000, np.random.default_rng(0)).std(axis=0)
    assert (spread > 0.15).all(), (
        f"draws that tell nothing give standard deviations {spread.round(3)}; the prior has 0.289"
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


def check_estimator(make_estimator: MakeEstimator, *, ordered: bool = True, accuracy: bool = True) -> None:
    """Every check in turn.

    Args:
        make_estimator: builds a fresh estimator; called many times.
        ordered: whether the order of the points may matter; False also checks permutation invariance, and leaves
            out those of accuracy, whose closed form needs to know the points apart.
        accuracy: whether to hold the estimator against the known posterior (it trains on 400 draws, twice).

    Raises:
        AssertionError: the first check that fails, saying how.
    """
    estimator, row = _fitted(make_estimator)
    posterior = estimator.posterior(row)
    check_shapes_and_support(posterior, 2)
    check_normalised(posterior, 2)
    check_save_and_load(posterior)
    for check in (
        check_deterministic,
        check_global_random_state,
        check_too_few_draws,
        check_failed_draws,
        check_constant_summaries,
        check_missing_points,
    ):
        check(make_estimator)
    if not ordered:
        check_permutation_invariant(make_estimator)
    elif accuracy:
        check_linear_gaussian(make_estimator)
        check_calibrated(make_estimator)
