"""NN-bulk, GP-bulk, and the Gaussian on the cube that both answer with."""

import sys
from functools import partial

import numpy as np
import pytest

from muslin.core.errors import BrokenPluginError
from muslin.core.testing import estimators as kit

torch = pytest.importorskip("torch")

from muslin.inference.embedding.rows import TrajectoryRows  # noqa: E402
from muslin.inference.estimators.gp_bulk import GPBulk  # noqa: E402
from muslin.inference.estimators.nn_bulk import NNBulk  # noqa: E402
from muslin.inference.posterior.cube_gaussian import cube_gaussian  # noqa: E402


def quick(**options: object) -> NNBulk:
    return NNBulk(**{"members": 2, "max_epochs": 60, **options})  # type: ignore[arg-type]


@pytest.mark.slow
def test_nn_bulk_conforms() -> None:
    kit.check_estimator(quick)


def test_nn_bulks_paper_preset_runs() -> None:
    theta, x = kit.LinearGaussian.make().draws(30, 0)
    short = NNBulk(preset="paper", max_epochs=2, hidden=[32, 32, 32])
    short.fit(theta, x)
    kit.check_normalised(short.posterior([x[0][0]]), 2)


@pytest.mark.slow
def test_gp_bulk_conforms() -> None:
    pytest.importorskip("botorch")
    kit.check_estimator(lambda: GPBulk(principal=6, tuning_draws=100, steps=20))


def test_bulk_estimators_read_sets_in_any_order_and_of_every_size() -> None:
    """Their rows are of one length: of more points than they learned from they take as many."""
    pytest.importorskip("botorch")
    for make in (partial(GPBulk, correspondence=False, principal=4, steps=10), partial(quick, correspondence=False)):
        kit.check_permutation_invariant(make)
        kit.check_varying_counts(make)


def test_of_more_points_as_many_are_read_evenly_along_their_order() -> None:
    rng = np.random.default_rng(0)
    x = rng.random((30, 2, 5, 3))
    rows = TrajectoryRows([x], (False,), True, 5)
    many = np.sort(rng.random((1, 2, 13, 3)), axis=2)
    (told,) = rows([many[:, :, rng.permutation(13)]])
    (same,) = rows([many[:, :, [0, 3, 6, 9, 12]]])
    torch.testing.assert_close(told, same)
    many[0, 0, 4:] = np.nan  # four that are seen are all read, whatever is not
    (told,), (same,) = rows([many]), rows([many[:, :, [0, 1, 2, 3, 12]]])
    torch.testing.assert_close(told[:, :12], same[:, :12])  # the fifth is filled in, by the other frame too


def test_gp_bulk_follows_a_curve_and_knows_its_noise() -> None:
    pytest.importorskip("botorch")
    rng = np.random.default_rng(0)
    theta = rng.random((300, 1))
    x = [(np.sin(theta) + 0.02 * rng.standard_normal((300, 8)))[:, None, :, None]]
    estimator = GPBulk()
    estimator.fit(theta, x)
    row = np.full((1, 8, 1), np.sin(0.4))
    posterior = estimator.posterior([row])
    exact = 0.02 / np.sqrt(8) / np.cos(0.4)
    assert posterior.mean()[0] == pytest.approx(0.4, abs=2 * exact)
    assert 0.8 < posterior.std()[0] / exact < 1.6


def test_gp_bulk_subsamples_what_is_too_much_and_honours_weights() -> None:
    pytest.importorskip("botorch")
    rng = np.random.default_rng(0)
    theta = rng.beta(2.0, 1.0, (500, 1))  # density 2 theta, prior 1
    x = [rng.standard_normal((500, 2, 3, 2))]  # says nothing: the posterior is the prior
    estimator = GPBulk(draws=400, tuning_draws=100, principal=3, steps=20)
    estimator.fit(theta, x, log_weights=-np.log(2.0 * theta[:, 0]))
    means = [estimator.posterior([x[0][i]]).mean()[0] for i in range(10)]
    assert np.mean(means) == pytest.approx(0.5, abs=0.06)


def test_without_botorch_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "botorch.models", None)
    theta, x = kit.LinearGaussian.make().draws(20, 0)
    with pytest.raises(BrokenPluginError, match=r"muslin\[gp\]"):
        GPBulk().fit(theta, x)


@pytest.mark.parametrize(
    ("mean", "sd"), [(0.5, 0.02), (0.5, 12**-0.5), (0.1, 0.08), (0.9, 0.1), (0.003, 0.002), (0.1, 0.1)]
)
def test_a_gaussian_on_the_cube_has_the_mean_and_deviation_that_were_given(mean: float, sd: float) -> None:
    posterior = cube_gaussian(np.array([mean]), np.array([[sd**2]]))
    assert posterior.mean()[0] == pytest.approx(mean, rel=0.01)
    assert posterior.std()[0] == pytest.approx(sd, rel=0.01)


def test_a_gaussian_on_the_cube_is_flat_at_most_and_keeps_its_mass_inside() -> None:
    flat = cube_gaussian(np.array([0.5]), np.array([[25.0]]))
    assert np.allclose(flat.log_prob(np.linspace(0.01, 0.99, 9)[:, None]), 0.0, atol=1e-3)
    for mean in (-3.0, 1.4):
        outside = cube_gaussian(np.array([mean]), np.array([[0.01]]))
        kit.check_shapes_and_support(outside, 1)
        assert abs(outside.mean()[0] - np.clip(mean, 0.0, 1.0)) == pytest.approx(0.1, abs=0.001)


def test_a_narrow_gaussian_on_the_cube_keeps_its_covariance() -> None:
    covariance = np.array([[4e-4, 3e-4], [3e-4, 9e-4]])
    posterior = cube_gaussian(np.array([0.5, 0.4]), covariance)
    draws = posterior.sample(20_000, np.random.default_rng(0))
    assert np.allclose(np.cov(draws.T), covariance, rtol=0.08)
    peak = posterior.log_prob(np.array([[0.5, 0.4]]))[0]
    assert peak == pytest.approx(-np.log(2 * np.pi) - 0.5 * np.log(np.linalg.det(covariance)), abs=0.05)
