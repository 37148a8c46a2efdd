"""Fused posteriors: information adds up, exactly where the parts are exact."""

from pathlib import Path

import numpy as np
import pytest

from muslin.core.errors import InputError
from muslin.core.testing.estimators import (
    LinearGaussian,
    check_normalised,
    check_samples_follow_density,
    check_save_and_load,
    check_shapes_and_support,
)
from muslin.inference.estimators.bayessim_rkhs import BayesSimRKHS
from muslin.inference.posterior.files import load_posterior
from muslin.inference.posterior.fusion import FusedPosterior
from muslin.inference.posterior.mixture import MixturePosterior, to_latent

SD = np.array([0.6, 0.3])


def linear_gaussian(count: int, seed: int = 0) -> tuple[list[MixturePosterior], np.ndarray, np.ndarray]:
    """Posteriors given one take each of z plus noise of standard deviation SD, the prior N(0, I); and the exact one."""
    takes = np.array([0.3, -0.5]) + SD * np.random.default_rng(seed).standard_normal((count, 2))
    precision = 1 / SD**2
    one = np.diag(1 / np.sqrt(1 + precision))[None]
    parts = [MixturePosterior(np.ones(1), (precision * t / (1 + precision))[None], one) for t in takes]
    total = 1 + count * precision
    return parts, precision * takes.sum(axis=0) / total, 1 / np.sqrt(total)


@pytest.mark.parametrize("takes", [1, 4, 16])
def test_standard_deviations_are_the_exact_ones_at_1_4_and_16_takes(takes: int) -> None:
    parts, mean, sd = linear_gaussian(takes)
    fused = FusedPosterior(parts)
    z = to_latent(fused.sample(8000, np.random.default_rng(1)))
    np.testing.assert_allclose(z.std(axis=0), sd, rtol=0.03)
    np.testing.assert_allclose(z.mean(axis=0), mean, atol=0.04 * sd.max())
    exact = MixturePosterior(np.ones(1), mean[None], np.diag(sd)[None])
    points = exact.sample(500, np.random.default_rng(2))
    np.testing.assert_allclose(fused.log_prob(points), exact.log_prob(points), atol=0.03)


def bimodal() -> list[MixturePosterior]:
    """Each part has the mode that all share and one of its own."""
    return [
        MixturePosterior(np.array([0.5, 0.5]), np.array([[0.4, 0.0], m]), np.repeat(0.2 * np.eye(2)[None], 2, axis=0))
        for m in ([-1.5, 0.0], [0.4, 1.5], [1.9, -1.0])
    ]


def test_a_mode_that_one_take_rules_out_is_gone() -> None:
    fused = FusedPosterior(bimodal())
    z = to_latent(fused.sample(4000, np.random.default_rng(0)))
    assert (np.linalg.norm(z - [0.4, 0.0], axis=1) < 0.6).all()
    np.testing.assert_allclose(z.std(axis=0), 1 / np.sqrt(3 / 0.04 - 2), rtol=0.06)


def test_a_fused_posterior_passes_the_checks_of_every_posterior(tmp_path: Path) -> None:
    for parts in (linear_gaussian(4)[0], bimodal()[:2]):
        fused = FusedPosterior(parts)
        check_shapes_and_support(fused, 2)
        check_normalised(fused, 2)
        check_samples_follow_density(fused, 2)
        check_save_and_load(fused)
    fused.save(tmp_path / "fused.npz")
    assert isinstance(load_posterior(tmp_path / "fused.npz"), FusedPosterior)


def test_what_cannot_be_fused_is_said(tmp_path: Path) -> None:
    far = [MixturePosterior(np.ones(1), np.array([[m]]), np.array([[[1e-3]]])) for m in (-5.0, 5.0)]
    with pytest.raises(InputError, match="contradict"):
        FusedPosterior(far)
    with pytest.raises(InputError, match="same parameters"):
        FusedPosterior([far[0], linear_gaussian(1)[0][0]])
    (tmp_path / "x.npz").write_bytes(b"no")
    with pytest.raises(InputError, match="not a saved"):
        FusedPosterior.load(tmp_path / "x.npz")


@pytest.mark.slow
def test_learned_posteriors_narrow_with_the_takes_as_the_exact_ones_do() -> None:
    """One estimator trained on single takes, fused, against one trained on the mean of the takes."""
    case, rng = LinearGaussian.make(), np.random.default_rng(0)
    theta, x = case.draws(400, 1)
    takes = [case.simulate(np.array([[0.5, 0.5]]), rng)[0] for _ in range(16)]
    exact = np.sqrt(np.diag(case.covariance))
    single = BayesSimRKHS()
    single.fit(theta, x, seed=0)
    parts = [single.posterior([t]) for t in takes]
    for count in (1, 16):
        pooled = BayesSimRKHS()
        pooled.fit(theta, [np.mean([case.simulate(theta, rng) for _ in range(count)], axis=0)], seed=0)
        together = pooled.posterior([np.mean(takes[:count], axis=0)])
        for name, posterior in (("product", FusedPosterior(parts[:count])), ("mean of takes", together)):
            ratio = posterior.sample(4000, rng).std(axis=0) / (exact / np.sqrt(count))
            print(f"{count} takes, {name}: standard deviation over the exact one {ratio.round(2)}")
            assert (ratio > 0.7).all()
            assert (ratio < 2.0).all()
