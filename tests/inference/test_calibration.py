"""Calibration of known posteriors: exact ones pass, wrong ones are called what they are."""

from collections import Counter

import numpy as np
import pytest

pytest.importorskip("torch")

from known import exact
from small import NOISE as POINT_NOISE

from muslin.core.arrays import FloatArray
from muslin.core.errors import InputError
from muslin.core.estimator import Posterior, PosteriorEstimator
from muslin.core.measurement import Recording
from muslin.core.series import PointSeries
from muslin.core.testing.estimators import LinearGaussian
from muslin.inference.calibration.held_out import held_out_ranks
from muslin.inference.calibration.predictive import Predictive, predictive_check
from muslin.inference.calibration.ranks import Ranks, rank_cases
from muslin.inference.calibration.verdict import TOGETHER, Verdict, judge
from muslin.inference.calibration.warn import calibration_warnings
from muslin.inference.noise import Noise
from muslin.inference.posterior.mixture import MixturePosterior, to_latent
from muslin.inference.residuals import Offsets

NAMES = ("stiffness", "friction", "mass")
#: Where a proposal lies, in probit coordinates.
PLACE, WIDTH = 0.6, 0.45
PROPOSAL = MixturePosterior(np.ones(1), np.full((1, 3), PLACE), WIDTH * np.eye(3)[None])


def told(seed: int, count: int = 150, **wrong: float) -> Verdict:
    rng = np.random.default_rng(seed)
    return judge(rank_cases(exact(rng.standard_normal((count, 3)), rng, **wrong), rng, draws=200), NAMES, rng)


def test_exact_posteriors_have_uniform_ranks() -> None:
    rng = np.random.default_rng(0)
    ranks = rank_cases(exact(rng.standard_normal((1000, 3)), rng), rng, draws=100)
    for column in (*ranks.parameter.T, ranks.region, ranks.tarp):
        share, _ = np.histogram(column, 10, (0, 1))
        assert np.sum((share - 100) ** 2 / 100) < 27.9  # chi-square with 9 degrees of freedom, 0.1 %
    assert ranks.effective == pytest.approx(1000)


@pytest.mark.parametrize(
    ("wrong", "word"),
    [({"width": 0.6}, "over-confident"), ({"width": 1.6}, "under-confident"), ({"shift": 0.7}, "biased")],
)
def test_wrong_posteriors_are_called_what_they_are(wrong: dict[str, float], word: str) -> None:
    words = [told(seed, **wrong) for seed in range(3)]
    assert [v.word for v in words] == [word] * 3
    for verdict in words:
        found = {r.name for r in verdict.rows if r.finding == word}
        assert found == ({"stiffness"} if word == "biased" else set(NAMES))


def test_sentences_name_what_intervals_hold_and_where_a_bias_lies() -> None:
    said = told(0, width=0.6).sentences()[0]
    # Phi(1.28 x 0.6) gives 56 %
    held = [r.held for r in told(0, width=0.6).rows[:3]]
    assert held == pytest.approx([0.56] * 3, abs=0.13)
    assert said.startswith("over-confident: intervals that should hold 80% hold ") and "in stiffness" in said
    assert "biased in stiffness (the truth lies 0." in told(0, shift=0.7).sentences()[0]
    assert "sd below the middle" in told(0, shift=0.7).sentences()[0]
    assert "sd above the middle" in told(0, shift=-0.7).sentences()[0]
    assert told(0).sentences()[0].startswith("calibrated, as far as 150 cases can tell")


def test_a_correlation_that_is_not_there_shows_in_all_parameters_together() -> None:
    verdict = told(1, count=300, correlation=0.95)
    assert verdict.word == "over-confident" and verdict.rows[-1].finding == "over-confident"
    assert verdict.rows[-1].name == TOGETHER and not any(r.finding for r in verdict.rows[:-1])
    assert "regions that should hold 80%" in verdict.sentences()[0]


def test_false_alarms_are_as_rare_as_promised() -> None:
    """Of 200 verdicts on exact ranks; 5 % are promised at most, and 10 % would be 20 +- 4."""
    rng = np.random.default_rng(0)
    words: Counter[str] = Counter()
    for _ in range(200):
        u = rng.random((80, 5))
        words[judge(Ranks(u[:, :3], u[:, 3], u[:, 4], np.ones(80)), NAMES, rng).word] += 1
    assert words["calibrated"] >= 200 - 16, words


@pytest.mark.slow
def test_weighted_cases_and_tilted_posteriors_judge_draws_from_a_proposal() -> None:
    """Exact posteriors under the prior: ranks of the proposal's draws are not uniform unless they are corrected."""
    rng = np.random.default_rng(3)
    plain: Counter[str] = Counter()
    for _ in range(5):
        latent = PLACE + WIDTH * rng.standard_normal((150, 3))
        plain[judge(rank_cases(exact(latent, rng), rng, draws=200), NAMES, rng).word] += 1
    assert plain["calibrated"] == 0
    tilted, weighted = Counter[str](), Counter[str]()
    for _ in range(10):
        latent = PLACE + WIDTH * rng.standard_normal((150, 3))
        ranks = rank_cases(exact(latent, rng), rng, draws=200, log_tilt=PROPOSAL.log_prob)
        tilted[judge(ranks, NAMES, rng).word] += 1
        latent = np.where(rng.random((300, 1)) < 0.8, PLACE + WIDTH * rng.standard_normal((300, 3)),
                          rng.standard_normal((300, 3)))  # fmt: skip
        cases = exact(latent, rng)
        weights = 1 / (0.2 + 0.8 * np.exp(PROPOSAL.log_prob(np.stack([t for _, t in cases]))))
        weighted[judge(rank_cases(cases, rng, draws=200, weights=weights), NAMES, rng).word] += 1
    assert tilted["calibrated"] >= 8 and weighted["calibrated"] >= 8, (tilted, weighted)
    latent = PLACE + WIDTH * rng.standard_normal((150, 3))
    ranks = rank_cases(exact(latent, rng, width=0.6), rng, draws=200, log_tilt=PROPOSAL.log_prob)
    assert judge(ranks, NAMES, rng).word == "over-confident"


def test_too_few_cases_tell_nothing() -> None:
    verdict = told(0, count=15)
    assert verdict.word == "cannot-tell" and "15 cases are too few" in verdict.sentences()[0]
    assert verdict.to_json()["rows"] == []


def test_tarp_is_that_of_sbi() -> None:
    """The same definition: with sbi's reference points put in, and its scaling by the range of the truths undone."""
    pytest.importorskip("sbi")
    import torch
    from sbi.diagnostics.tarp import _run_tarp
    from sbi.utils.metrics import l2

    rng = np.random.default_rng(4)
    cases = exact(rng.standard_normal((400, 2)), rng, width=0.6)
    samples = torch.tensor(np.stack([p.sample(200, rng) for p, _ in cases], axis=1))
    truths, spots = torch.tensor(np.stack([t for _, t in cases])), torch.tensor(rng.random((400, 2)))
    ecp, alpha = _run_tarp(samples, truths, spots, distance=l2, num_bins=20)
    ours = rank_cases(cases, rng, draws=200).tarp
    held = [float(np.mean(ours <= a)) for a in alpha.numpy()]
    assert held == pytest.approx(ecp.numpy(), abs=0.08)
    assert held[5] > 0.25 + 0.04 and held[15] < 0.75 - 0.04  # over-confident: too many at either end


class KnownEstimator(PosteriorEstimator):
    """The exact posterior of a linear-Gaussian case without bounds, ``factor`` times as wide; learns nothing."""

    name = "known"
    factor = 1.0
    trained_on: FloatArray | None = None

    def fit(
        self, theta: FloatArray, x: list[FloatArray], *, log_weights: FloatArray | None = None, seed: int = 0
    ) -> None:
        type(self).trained_on = theta

    def posterior(self, x: list[FloatArray]) -> Posterior:
        seen = x[0].ravel()[:2]
        scale = self.factor * 0.2**0.5
        return MixturePosterior(np.ones(1), (0.8 * seen)[None], scale * np.eye(2)[None])


class Narrow(KnownEstimator):
    factor = 0.5


def draws(count: int, seed: int = 0) -> tuple[FloatArray, list[FloatArray]]:
    rng = np.random.default_rng(seed)
    theta = rng.random((count, 2))
    return theta, [(to_latent(theta) + 0.5 * rng.standard_normal((count, 2))).reshape(count, 1, 2, 1)]


def test_a_draw_is_ranked_by_an_estimator_that_has_not_seen_it() -> None:
    theta, x = draws(100)
    seen = []

    class Watching(KnownEstimator):
        def posterior(self, x: list[FloatArray]) -> Posterior:
            assert self.trained_on is not None
            seen.append((len(self.trained_on), float(x[0].ravel()[0])))
            return super().posterior(x)

    ranks = held_out_ranks(Watching, theta, x, None, 0)
    assert [n for n, _ in seen] == [80] * 100 and sorted(v for _, v in seen) == sorted(x[0][:, 0, 0, 0])
    assert ranks.parameter.shape == (100, 2)
    weights = np.where(np.arange(100) < 60, 0.0, -np.inf)
    assert len(held_out_ranks(KnownEstimator, theta, x, weights, 0).weights) == 60
    with pytest.raises(InputError, match="too few"):
        held_out_ranks(KnownEstimator, theta[:15], [x[0][:15]], None, 0)


def test_a_fit_is_warned_about_when_it_is_over_confident_and_not_otherwise() -> None:
    theta, x = draws(400)
    assert calibration_warnings(KnownEstimator, theta, x, None, 0, ("a", "b")) == []
    said = calibration_warnings(Narrow, theta, x, None, 0, ("a", "b"))
    assert len(said) == 2 and "over-confident in a" in said[0] and "muslin calibrate" in said[0]
    assert calibration_warnings(Narrow, theta[:12], [x[0][:12]], None, 0, ("a", "b")) == []


@pytest.mark.slow
def test_a_real_estimator_is_not_warned_about_on_the_linear_gaussian_case() -> None:
    from muslin.inference.estimators.bayessim_rkhs import BayesSimRKHS

    theta, x = LinearGaussian.make().draws(300, 1)
    assert calibration_warnings(BayesSimRKHS, theta, x, None, 0, ("a", "b")) == []


def check(measured: FloatArray, predictions: FloatArray, correspondence: bool = True) -> Predictive:
    time = np.arange(len(measured)) * 0.1
    recording = Recording("take", PointSeries(time, measured, correspondence=correspondence))
    noise = Noise(POINT_NOISE, 0.0, "test", "m", 0.02)
    return predictive_check(recording, "fit", list(predictions), noise, Offsets(), np.random.default_rng(0))[0]


@pytest.mark.parametrize("correspondence", [True, False])
def test_a_measurement_that_the_posterior_predicts_is_like_it_and_another_is_not(correspondence: bool) -> None:
    """Predictions sway to and fro with the draws; the measurement is one of them, or moves in a way that none does."""
    rng = np.random.default_rng(0)
    rest = np.stack([np.arange(5) * 0.2, np.zeros(5), np.zeros(5)], axis=1)
    time, way = np.arange(20)[:, None, None], np.array([0.0, 0.01, 0.0])
    predictions = np.stack([rest + a * way * np.sin(time / 4) for a in 1 + 0.3 * rng.standard_normal(60)])
    noise = POINT_NOISE * rng.standard_normal(predictions[0].shape)
    fair = rest + 1.2 * way * np.sin(time / 4) + noise
    assert not check(fair, predictions, correspondence).finding
    other = check(fair + np.array([0.01, 0.0, 0.0]) * np.cos(time), predictions, correspondence)
    assert other.finding == "unlike" and other.measured > other.high and "unlike all" in other.text()
    still = check(predictions.mean(axis=0), predictions, correspondence)
    assert still.finding == "too-wide" and still.measured < still.low
    gaps = fair.copy()
    gaps[3:9, 2] = np.nan
    assert not check(gaps, predictions, correspondence).finding
