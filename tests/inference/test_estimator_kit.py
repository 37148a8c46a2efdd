"""Each check of the kit passes on an exact estimator and fails on one broken in just that way."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.errors import InputError
from muslin.core.estimator import Posterior, PosteriorEstimator
from muslin.core.testing import estimators as kit

CASE = kit.LinearGaussian.make()


class GridPosterior(Posterior):
    """A density that is constant on the cells of a 200 x 200 grid: all answers exact, numpy alone."""

    size = 200
    dim = 2

    def __init__(self, mass: FloatArray) -> None:
        self.mass = mass / mass.sum()

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        cells = rng.choice(self.mass.size, size=count, p=self.mass.ravel())
        corner = np.stack(np.unravel_index(cells, self.mass.shape), axis=1)
        return np.asarray((corner + rng.random((count, 2))) / self.size)

    def log_prob(self, unit: FloatArray) -> FloatArray:
        cell = np.clip((unit * self.size).astype(int), 0, self.size - 1)
        inside = ((unit >= 0) & (unit <= 1)).all(axis=1)
        density = np.log(self.mass[cell[:, 0], cell[:, 1]] * self.size**2 + 1e-300)
        return np.where(inside, density, -np.inf)

    def save(self, path: Path) -> None:
        with path.open("wb") as file:
            np.savez(file, mass=self.mass)

    @classmethod
    def load(cls, path: Path) -> "GridPosterior":
        with np.load(path) as data:
            posterior = cls.__new__(cls)
            posterior.mass = data["mass"]
            return posterior


class Exact(PosteriorEstimator):
    """Knows the kit's case; uses the draws only to see whether they say anything."""

    name = "exact"
    spread = 1.0
    wrapper: type[GridPosterior] = GridPosterior

    def fit(
        self, theta: FloatArray, x: list[FloatArray], *, log_weights: FloatArray | None = None, seed: int = 0
    ) -> None:
        if len(theta) < 10 or np.isnan(x[0]).all(axis=(1, 2, 3)).any():
            raise InputError("too few draws, or failed ones")
        self.told = bool(np.nanmax(np.abs(x[0] - x[0][:1])) > 0)

    def _estimate(self, x: FloatArray) -> FloatArray:
        seen = np.isfinite((x - CASE.rest).ravel())
        return np.linalg.lstsq(CASE.jacobian[seen], (x - CASE.rest).ravel()[seen], rcond=None)[0]

    def posterior(self, x: list[FloatArray]) -> Posterior:
        axis = (np.arange(200) + 0.5) / 200
        grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1) - self._estimate(x[0])
        chi = np.einsum("abi,ij,abj->ab", grid, np.linalg.inv(CASE.covariance), grid) / self.spread**2
        return self.wrapper(np.exp(-0.5 * (chi - chi.min()) * self.told) + 1e-12)


class LeakingPosterior(GridPosterior):
    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        return super().sample(count, rng) * 1.2 - 0.1 + 0.4


class UnnormalisedPosterior(GridPosterior):
    def log_prob(self, unit: FloatArray) -> FloatArray:
        return super().log_prob(unit) + 0.1


class ForgetfulPosterior(GridPosterior):
    @classmethod
    def load(cls, path: Path) -> "GridPosterior":
        return GridPosterior(np.float32(np.load(path)["mass"]).astype(float))


class Shifted(Exact):
    def _estimate(self, x: FloatArray) -> FloatArray:
        return super()._estimate(x) + 0.06


class Overconfident(Exact):
    spread = 0.4


class Unseeded(Exact):
    def posterior(self, x: list[FloatArray]) -> Posterior:
        return GridPosterior(super().posterior(x).mass + np.random.default_rng().random() * 1e-3)  # type: ignore[attr-defined]


class Global(Exact):
    def posterior(self, x: list[FloatArray]) -> Posterior:
        np.random.rand(1)  # noqa: NPY002
        return super().posterior(x)


class Careless(Exact):
    def fit(self, theta, x, *, log_weights=None, seed=0):  # type: ignore[no-untyped-def]
        self.told = True


class Brittle(Careless):
    """NaN in, NaN out; certain of itself when the draws say nothing."""

    def _estimate(self, x: FloatArray) -> FloatArray:
        return CASE.jacobian.T @ (x - CASE.rest).ravel()


def exact_posterior(kind: type[GridPosterior] = GridPosterior) -> Posterior:
    estimator = Exact()
    estimator.wrapper = kind
    theta, x = CASE.draws(20, 0)
    estimator.fit(theta, x)
    return estimator.posterior([x[0][0]])


def test_the_exact_estimator_passes() -> None:
    kit.check_estimator(Exact)


@pytest.mark.parametrize(
    ("check", "kind", "message"),
    [
        (lambda p: kit.check_shapes_and_support(p, 2), LeakingPosterior, "outside the unit cube"),
        (lambda p: kit.check_normalised(p, 2), UnnormalisedPosterior, "integrates to 1.1"),
        (kit.check_save_and_load, ForgetfulPosterior, "changed between save and load"),
    ],
)
def test_a_broken_posterior_is_caught(
    check: Callable[[Posterior], None], kind: type[GridPosterior], message: str
) -> None:
    check(exact_posterior())
    with pytest.raises(AssertionError, match=message):
        check(exact_posterior(kind))


@pytest.mark.parametrize(
    ("check", "broken", "message"),
    [
        (kit.check_linear_gaussian, Shifted, "standard deviations off"),
        (kit.check_linear_gaussian, Overconfident, "times the exact ones"),
        (kit.check_calibrated, Overconfident, "80 % intervals"),
        (kit.check_permutation_invariant, Exact, "permuting the points of the measurement"),
        (kit.check_deterministic, Unseeded, "same draws and seed differ"),
        (kit.check_global_random_state, Global, "global random state was changed"),
        (kit.check_too_few_draws, Careless, "three draws are accepted"),
        (kit.check_failed_draws, Careless, "all-NaN draw is accepted"),
        (kit.check_constant_summaries, Careless, "draws that tell nothing"),
        (kit.check_missing_points, Brittle, "finite|NaN|outside"),
    ],
)
def test_a_broken_estimator_is_caught(
    check: Callable[[kit.MakeEstimator], None], broken: type[Exact], message: str
) -> None:
    if check is not kit.check_permutation_invariant:
        check(Exact)
    with pytest.raises((AssertionError, ValueError), match=message):
        check(broken)
