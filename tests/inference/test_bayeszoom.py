import numpy as np
import pytest

from muslin.core.testing import estimators as kit

torch = pytest.importorskip("torch")

from muslin.inference.estimators.bayeszoom import BayesZoom, BayesZoomRKHS  # noqa: E402
from muslin.inference.estimators.densities import error_covariance  # noqa: E402


def zoom(**options: object) -> BayesZoom:
    return BayesZoom(**{"members": 2, "max_epochs": 60, **options})  # type: ignore[arg-type]


def zoom_rkhs(**options: object) -> BayesZoomRKHS:
    return BayesZoomRKHS(**{"features": 16, "max_epochs": 5, "members": 2, "summary_epochs": 40, **options})  # type: ignore[arg-type]


@pytest.mark.slow
def test_conforms() -> None:
    kit.check_estimator(zoom)


@pytest.mark.slow
def test_the_one_on_embeddings_conforms() -> None:
    kit.check_estimator(zoom_rkhs)


@pytest.mark.slow
def test_the_one_on_embeddings_conforms_on_sets() -> None:
    """But for the width, which by design is the same for sets of two points and of thirty."""
    kit.check_estimator(lambda: zoom_rkhs(correspondence=False), ordered=False, accuracy=False)


def test_the_posterior_is_one_gaussian_of_the_same_width_for_measurements_of_the_inner_region() -> None:
    case = kit.LinearGaussian.make()
    theta, x = case.draws(300, 0)
    estimator = zoom()
    estimator.fit(theta, x)
    rows = case.simulate(np.array([[0.45, 0.5], [0.55, 0.5]]), np.random.default_rng(0))
    first, second = (estimator.posterior([row]) for row in rows)
    assert len(first.weights) == 1
    assert np.allclose(first.std(), second.std(), rtol=0.05)


def test_the_l1_error_gives_the_standard_deviation_of_a_gaussian() -> None:
    rng = np.random.default_rng(0)
    errors = rng.multivariate_normal(np.zeros(2), [[0.04, 0.01], [0.01, 0.01]], 20_000)
    weights = np.ones(len(errors))
    found = error_covariance(errors, weights, "l1", True)
    assert np.allclose(found, [[0.04, 0.01], [0.01, 0.01]], rtol=0.06)
    assert np.allclose(error_covariance(errors, weights, "l2", False), np.diag([0.04, 0.01]), rtol=0.06)


@pytest.mark.parametrize("kind", [BayesZoom, BayesZoomRKHS])
def test_the_papers_preset_has_its_settings_and_runs(kind: type[BayesZoom] | type[BayesZoomRKHS]) -> None:
    s = kind(preset="paper").settings
    assert (s.hidden, s.learning_rate, s.correlated) == ((1024, 1024, 1024), 1e-6, False)
    theta, x = kit.LinearGaussian.make().draws(30, 0)
    short = kind(preset="paper", max_epochs=2, hidden=[32, 32, 32])
    short.fit(theta, x)
    posterior = short.posterior([x[0][0]])
    assert len(posterior.weights) == 1
    kit.check_normalised(posterior, 2)
