"""How an estimator behaves whatever it learns: it repeats itself, leaves everything else alone, and reads sets."""

import random
from typing import Any, cast

import numpy as np

from ...errors import StepMissingError
from ..checks import must
from .cases import LinearGaussian, MakeEstimator, fitted
from .posterior import same


def _global_state() -> list[object]:
    state = cast(tuple[Any, ...], np.random.get_state(legacy=True))  # noqa: NPY002
    return [np.asarray(part).tolist() for part in state]


def check_deterministic(make: MakeEstimator) -> None:
    """The same draws and seed give the same posterior to the bit; fitting again replaces the last fit."""
    a, row = fitted(make)
    b, _ = fitted(make)
    reference = a.posterior(row)
    must(same(reference, b.posterior(row)), "two fits with the same draws and seed differ")
    must(same(reference, a.posterior(row)), "asking for the posterior twice gives different ones")
    theta, x = LinearGaussian.make().draws(60, 1)
    a.fit(1.0 - theta, [-2.0 * x[0]], seed=1)
    a.fit(theta, x, seed=0)
    must(same(reference, a.posterior(row)), "a fit depends on what was fitted before on the same object")


def check_global_random_state(make: MakeEstimator) -> None:
    """Fitting and asking for a posterior leave the global generators of numpy and random alone, and the seed counts."""
    before, python = _global_state(), random.getstate()
    estimator, row = fitted(make)
    estimator.posterior(row).sample(5, np.random.default_rng(0))
    must(_global_state() == before, "numpy's global random state was changed; use the seed in a Generator of your own")
    must(random.getstate() == python, "the random module's global state was changed")


def check_inputs_left_alone(make: MakeEstimator) -> None:
    """Neither the draws nor the measurement are written to."""
    theta, x = LinearGaussian.make().draws(60, 1)
    weights, row = np.zeros(60), x[0][0].copy()
    kept = [a.copy() for a in (theta, x[0], weights, row)]
    estimator = make()
    estimator.fit(theta, x, log_weights=weights, seed=0)
    estimator.posterior([row])
    for name, now, then in zip(
        ("theta", "x", "log_weights", "the measurement"), (theta, x[0], weights, row), kept, strict=True
    ):
        must(np.array_equal(now, then), f"the caller's {name} was written to; work on a copy")


def check_fit_comes_first(make: MakeEstimator) -> None:
    """Asked for a posterior before it was fitted, it raises StepMissingError."""
    _, x = LinearGaussian.make().draws(1, 1)
    try:
        make().posterior([x[0][0]])
    except StepMissingError:
        return
    except Exception as error:
        raise AssertionError(
            f"before fit it raises {type(error).__name__} instead of StepMissingError: {error}"
        ) from error
    raise AssertionError("it gives a posterior before fit; raise StepMissingError")


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
        must(gap < 1e-6, f"permuting the points of {when} changes log_prob by up to {gap:.2g}")
