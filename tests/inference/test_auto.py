from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.errors import InputError, StepMissingError, UnknownPluginError
from muslin.core.estimator import PosteriorEstimator
from muslin.core.registry import REGISTRY
from muslin.core.testing import estimators as kit

torch = pytest.importorskip("torch")

from muslin.inference.estimators.auto import Auto  # noqa: E402
from muslin.inference.estimators.inputs import checked  # noqa: E402
from muslin.inference.posterior.files import load_posterior  # noqa: E402
from muslin.inference.posterior.mixture import MixturePosterior, to_latent  # noqa: E402
from muslin.inference.posterior.stacked import StackedPosterior  # noqa: E402


class Straight(PosteriorEstimator):
    """The mean of all points as a straight line of the parameters, with errors of a fixed size."""

    name = "straight"
    spread = 0.4

    def __init__(self, **options: Any) -> None:
        self.line: FloatArray | None = None

    def fit(
        self, theta: FloatArray, x: list[FloatArray], *, log_weights: FloatArray | None = None, seed: int = 0
    ) -> None:
        theta, x, _ = checked(theta, x, log_weights)
        self.line = np.linalg.lstsq(self._rows(x[0]), to_latent(theta, 1e-3), rcond=None)[0]

    def _rows(self, x: FloatArray) -> FloatArray:
        return np.concatenate([np.ones((len(x), 1)), x.reshape(len(x), -1)], axis=1)

    def posterior(self, x: list[FloatArray]) -> MixturePosterior:
        if self.line is None:
            raise StepMissingError("straight has no posterior before fit")
        mean = self._rows(x[0][None]) @ self.line
        return MixturePosterior(np.ones(1), mean, self.spread * np.eye(mean.shape[1])[None])


class Lost(Straight):
    """Sure of the wrong place."""

    name = "lost"

    def posterior(self, x: list[FloatArray]) -> MixturePosterior:
        good = super().posterior(x)
        return MixturePosterior(good.weights, good.means + 3.0, good.cholesky)


class Unwilling(Straight):
    name = "unwilling"

    def fit(self, *given: Any, **named: Any) -> None:
        raise InputError("not these")


@pytest.fixture(autouse=True)
def _registered() -> Iterator[None]:
    for kind in (Straight, Lost, Unwilling):
        REGISTRY.add("estimator", kind.name, kind)
    yield
    for kind in (Straight, Lost, Unwilling):
        del REGISTRY._objects["estimator", kind.name]


def test_the_one_that_predicts_is_kept_and_the_one_that_does_not_is_dropped() -> None:
    theta, x = kit.LinearGaussian.make().draws(200, 0)
    auto = Auto(estimators=["straight", "lost", "unwilling"])
    auto.fit(theta, x)
    assert auto.weights == {"straight": 1.0}
    alone = Straight()
    alone.fit(theta, x)
    points = np.random.default_rng(0).random((50, 2))
    row = [x[0][0]]
    assert auto.posterior(row).log_prob(points) == pytest.approx(alone.posterior(row).log_prob(points), rel=1e-6)


@pytest.mark.parametrize(
    "check",
    [
        kit.check_deterministic,
        kit.check_global_random_state,
        kit.check_inputs_left_alone,
        kit.check_fit_comes_first,
        kit.check_too_few_draws,
        kit.check_failed_draws,
    ],
)
def test_behaves_as_an_estimator_must(check: Callable[[kit.MakeEstimator], None]) -> None:
    check(lambda: Auto(estimators=["straight", "lost"]))


def test_when_all_refuse_it_says_why() -> None:
    theta, x = kit.LinearGaussian.make().draws(40, 0)
    with pytest.raises(InputError, match="not these"):
        Auto(estimators=["unwilling"]).fit(theta, x)
    with pytest.raises(InputError, match="too few"):
        Auto(estimators=["straight", "lost"]).fit(theta[:5], [x[0][:5]])
    with pytest.raises(StepMissingError):
        Auto(estimators=["straight"]).posterior([x[0][0]])


@pytest.mark.parametrize("names", [[], ["straight", "straight"], ["auto"], "straight", [3]])
def test_names_that_make_no_sense_are_refused(names: Any) -> None:
    with pytest.raises(InputError):
        Auto(estimators=names)


def test_an_unknown_name_or_option_is_refused() -> None:
    with pytest.raises(UnknownPluginError):
        Auto(estimators=["streight"])
    with pytest.raises(InputError, match="no option"):
        Auto(estimators=["straight"], members=3)


def test_a_mixture_of_posteriors_is_normalised_and_saved_exactly(tmp_path: Path) -> None:
    wide = MixturePosterior(np.ones(1), np.zeros((1, 2)), np.eye(2)[None])
    sharp = MixturePosterior(np.ones(1), np.ones((1, 2)), 0.2 * np.eye(2)[None])
    mixed = StackedPosterior(np.array([1.0, 3.0]), [wide, sharp])
    kit.check_shapes_and_support(mixed, 2)
    kit.check_normalised(mixed, 2)
    kit.check_save_and_load(mixed)
    mixed.save(tmp_path / "mixed.npz")
    points = np.random.default_rng(0).random((20, 2))
    exact = 0.25 * np.exp(wide.log_prob(points)) + 0.75 * np.exp(sharp.log_prob(points))
    assert np.exp(load_posterior(tmp_path / "mixed.npz").log_prob(points)) == pytest.approx(exact)


@pytest.mark.slow
def test_it_trains_real_estimators_by_name() -> None:
    theta, x = kit.LinearGaussian.make().draws(150, 0)
    auto = Auto(estimators=["npe-rkhs", "bayessim-rkhs"])
    auto.fit(theta, x)
    assert sum(auto.weights.values()) == pytest.approx(1.0)
    kit.check_normalised(auto.posterior([x[0][0]]), 2)
