"""Proposals: what they draw follows the density they say, and weighted draws follow the prior they are meant to."""

import numpy as np
import pytest
from scipy.special import logsumexp, ndtri

from muslin.core.estimator import Posterior
from muslin.core.study import parse_config
from muslin.inference.estimators.bayessim_rkhs import BayesSimRKHS
from muslin.inference.posterior.mixture import MixturePosterior
from muslin.inference.sequential.division import around, divide
from muslin.inference.sequential.ellipsoid import Ellipsoid
from muslin.inference.sequential.proposals import Density, Kind, Proposal, Proposals
from muslin.inference.sequential.region import TAIL, Region
from muslin.inference.sequential.success import Success

NARROW = MixturePosterior(
    np.array([0.6, 0.4]),
    np.array([[-1.0, 0.4], [1.2, -0.3]]),
    np.array([[[0.25, 0.0], [0.1, 0.3]], [[0.2, 0.0], [-0.1, 0.25]]]),
)
KINDS = ["truncated", "posterior", "gaussian"]


def brittle(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Draws of the prior that fail where the first parameter is large."""
    theta = np.random.default_rng(seed).random((count, 2))
    return theta, theta[:, 0] > 0.75


def test_the_region_holds_the_posterior_and_its_volume_is_right() -> None:
    """Of a Gaussian in probit coordinates far from the bounds the region is nearly an ellipse of known area."""
    sd = 0.02
    one = MixturePosterior(np.ones(1), np.zeros((1, 2)), sd * np.eye(2)[None])
    region = Region(one, np.random.default_rng(0))
    area = np.pi * (sd / np.sqrt(2 * np.pi)) ** 2 * -2 * np.log(TAIL)  # u is z / sqrt(2 pi) about the middle
    assert region.volume == pytest.approx(area, rel=0.1)
    wide = Region(NARROW, np.random.default_rng(1))
    held = np.isfinite(wide.log_prob(NARROW.sample(20_000, np.random.default_rng(2)))).mean()
    assert held == pytest.approx(1 - TAIL, abs=0.002)
    assert np.isfinite(wide.log_prob(wide.sample(2000, np.random.default_rng(3)))).all()


@pytest.mark.parametrize("success", [None, Success(*brittle(200))])
@pytest.mark.parametrize(
    "core", [Region(NARROW, np.random.default_rng(0)), NARROW, around(NARROW, np.random.default_rng(0))]
)
def test_a_proposal_draws_what_its_density_says(core: Density, success: Success | None) -> None:
    """Share of draws in each cell of a grid against the integral of the density over it."""
    proposal = Proposal(core, success, np.random.default_rng(1))
    draws = proposal.sample(40_000, np.random.default_rng(2))
    count, _, _ = np.histogram2d(draws[:, 0], draws[:, 1], bins=8, range=[[0, 1], [0, 1]])
    middle = (np.arange(400) + 0.5) / 400
    grid = np.stack(np.meshgrid(middle, middle, indexing="ij"), axis=-1).reshape(-1, 2)
    mass = np.exp(proposal.log_prob(grid)).reshape(8, 50, 8, 50).sum(axis=(1, 3)) / 400**2
    assert mass.sum() == pytest.approx(1.0, abs=0.02)
    assert np.abs(count / 40_000 - mass).max() < 0.008


@pytest.mark.parametrize("modes", [1, 2])
@pytest.mark.parametrize("kind", KINDS)
def test_weights_turn_the_draws_of_all_rounds_into_draws_of_the_prior_they_are_for(kind: Kind, modes: int) -> None:
    """Three rounds, the last two thinned by a success model, half of a mode failing: weighted means are right.

    The likelihood is Gaussian in probit coordinates, about 0.4 or about 0.4 and -0.4, so the posterior is known; the
    draws that fail are left out, and the posterior is the one restricted to where draws succeed.
    """
    centres = np.array([[0.4, 0.0], [-0.4, 0.0]])[:modes]

    def first(t: np.ndarray) -> np.ndarray:
        return logsumexp([-0.5 * ((t - c) / 0.1) ** 2 for c in centres[:, 0]], axis=0)

    proposals = Proposals(kind, 2, 0)
    theta = proposals.draw(30_000)
    assert proposals.log_weights(theta) is None
    for off, sd in ((0.1, 0.25), (0.05, 0.13)):
        latest = MixturePosterior(np.ones(modes), centres - off, np.repeat(sd * np.eye(2)[None], modes, axis=0))
        proposals.add(latest, theta[::100], theta[::100, 0] > 0.66)
        theta = np.concatenate([theta, proposals.draw(30_000)])
    kept = theta[:, 0] <= 0.66
    z = ndtri(theta[kept])
    log_l = first(z[:, 0]) - 0.5 * (z[:, 1] / 0.1) ** 2
    log_w = proposals.log_weights(theta[kept])
    assert log_w is not None
    if kind == "gaussian":  # what is learned is under the Gaussian, and is divided by it afterwards
        assert proposals._divisor is not None
        log_w = log_w - proposals._divisor.log_prob(theta[kept])
    w = np.exp(log_w + log_l)
    side = np.linspace(-1.5, float(ndtri(0.66)), 4001)
    density = np.exp(first(side) - 0.5 * side**2)
    assert w @ z[:, 0] / w.sum() == pytest.approx(density @ side / density.sum(), abs=0.015)
    assert w @ z[:, 1] / w.sum() == pytest.approx(0.0, abs=0.005)
    assert w @ z[:, 1] ** 2 / w.sum() == pytest.approx(1 / (1 + 0.1**-2), rel=0.04)
    worth = w.sum() ** 2 / (w**2).sum()
    prior = np.exp(log_l[: int(kept[:30_000].sum())])
    assert worth > 1.5 * 3 * prior.sum() ** 2 / (prior**2).sum()  # of as many draws of the prior


def joint_gaussian(z: np.ndarray, x: np.ndarray, log_w: np.ndarray | None, seen: np.ndarray) -> MixturePosterior:
    """The exact estimator of a linear-Gaussian case: the weighted covariance of both, conditioned on what was seen."""
    w = np.ones(len(z)) if log_w is None else np.exp(log_w - log_w.max())
    both = np.concatenate([z, x], axis=1)
    mean, covariance, d = w @ both / w.sum(), np.cov(both.T, aweights=w), z.shape[1]
    gain = covariance[:d, d:] @ np.linalg.inv(covariance[d:, d:])
    left = covariance[:d, :d] - gain @ covariance[d:, :d]
    return MixturePosterior(np.ones(1), (mean[:d] + gain @ (seen - mean[d:]))[None], np.linalg.cholesky(left)[None])


@pytest.mark.parametrize("kind", ["posterior", "gaussian"])
def test_posteriors_do_not_drift_over_rounds(kind: Kind) -> None:
    """Six rounds with an estimator that is exact on a linear-Gaussian case: mean and width stay the exact ones."""
    rng = np.random.default_rng(0)
    mix, noise = np.array([[1.0, 0.3], [-0.2, 0.8], [0.5, 0.5]]), 0.15
    seen = mix @ [0.5, -0.3]
    precision = np.eye(2) + mix.T @ mix / noise**2
    mean, sd = np.linalg.solve(precision, mix.T @ seen / noise**2), np.sqrt(np.diag(np.linalg.inv(precision)))
    proposals, theta, x = Proposals(kind, 2, 0), np.zeros((0, 2)), np.zeros((0, 3))
    for _ in range(6):
        draws = proposals.draw(1500)
        theta = np.concatenate([theta, draws])
        x = np.concatenate([x, ndtri(draws) @ mix.T + noise * rng.standard_normal((1500, 3))])
        learned = joint_gaussian(ndtri(theta), x, proposals.log_weights(theta), seen)
        posterior = proposals.corrected(learned)
        assert isinstance(posterior, MixturePosterior)
        np.testing.assert_allclose((posterior.means[0] - mean) / sd, 0.0, atol=0.2)
        own = posterior.cholesky[0] @ posterior.cholesky[0].T
        np.testing.assert_allclose(np.sqrt(np.diag(own)) / sd, 1.0, atol=0.08)
        proposals.add(posterior, theta, np.zeros(len(theta), bool))


@pytest.mark.slow
def test_truncated_rounds_close_in_on_the_exact_posterior() -> None:
    """A simulator that bends both parameters: KL(exact || learned) after three rounds is a part of that after one."""

    def f(u: np.ndarray) -> np.ndarray:
        a, b = u.T
        return np.stack([np.exp(2 * a) * (0.5 + b), np.sin(5 * a + 2 * b), 2 * a * b], axis=1)

    rng, noise = np.random.default_rng(0), 0.02
    seen = f(np.array([[0.4, 0.6]]))[0]
    middle = (np.arange(800) + 0.5) / 800
    grid = np.stack(np.meshgrid(middle, middle, indexing="ij"), axis=-1).reshape(-1, 2)
    mass = np.exp(-0.5 * ((seen - f(grid)) ** 2).sum(axis=1) / noise**2)
    mass /= mass.sum()
    there = mass > 1e-9
    proposals, theta, x = Proposals("truncated", 2, 0), np.zeros((0, 2)), np.zeros((0, 1, 3, 1))
    divergence = []
    for k in range(3):
        draws = proposals.draw(200)
        theta = np.concatenate([theta, draws])
        x = np.concatenate([x, (f(draws) + noise * rng.standard_normal((200, 3)))[:, None, :, None]])
        estimator = BayesSimRKHS()
        estimator.fit(theta, [x], log_weights=proposals.log_weights(theta), seed=k)
        posterior = estimator.posterior([seen[None, :, None]])
        log_p = np.log(mass[there] * 800**2)
        divergence.append(float(mass[there] @ (log_p - posterior.log_prob(grid[there]))))
        proposals.add(posterior, theta, np.zeros(len(theta), bool))
    print("KL(exact || learned) after each round:", np.round(divergence, 2))
    assert divergence[-1] < 0.6 * divergence[0]


def test_a_posterior_at_the_rim_of_what_was_drawn_is_told() -> None:
    rng = np.random.default_rng(0)
    inside = np.clip(0.4 + 0.02 * rng.standard_normal((4000, 2)), 0.0, 1.0)
    proposals = Proposals("truncated", 2, 0)
    theta, none = proposals.draw(50), np.zeros(50, bool)
    assert proposals.at_the_rim(inside, 2) == []  # the first round draws from all of the prior
    proposals.add(NARROW, theta, none, Ellipsoid.around(inside, rng))
    drawn = proposals.draw(200)
    assert (proposals.region.out(drawn) <= 1.0).all()  # type: ignore[union-attr]
    assert proposals.counting(np.concatenate([theta, drawn])) < 250  # those outside weigh nothing
    assert proposals.at_the_rim(inside, 2) == []
    (told,) = proposals.at_the_rim(inside + 0.08, 2)
    assert "rounds = 3" in told
    proposals.add(NARROW, drawn, np.zeros(200, bool))  # it goes on around the posterior
    held = proposals.region.out(NARROW.sample(2000, rng)) <= 1.0  # type: ignore[union-attr]
    assert held.mean() > 0.99


def test_division_by_a_gaussian_undoes_learning_under_it() -> None:
    """Multiply the posterior by the Gaussian and divide by the prior, exactly, and divide() must bring it back."""
    g = around(NARROW, np.random.default_rng(0))
    precision_g = np.linalg.inv(g.cholesky[0] @ g.cholesky[0].T)
    weights, means, factors = [], [], []
    for w, m, factor in zip(NARROW.weights, NARROW.means, NARROW.cholesky, strict=True):
        own = np.linalg.inv(factor @ factor.T)
        total = own + precision_g - np.eye(2)
        mean = np.linalg.solve(total, own @ m + precision_g @ g.means[0])
        quadratic = m @ own @ m + g.means[0] @ precision_g @ g.means[0] - mean @ total @ mean
        weights.append(w * np.sqrt(np.linalg.det(own) / np.linalg.det(total)) * np.exp(-0.5 * quadratic))
        means.append(mean)
        factors.append(np.linalg.cholesky(np.linalg.inv(total)))
    back = divide(MixturePosterior(np.array(weights), np.array(means), np.array(factors)), g)
    assert back is not None
    points = NARROW.sample(200, np.random.default_rng(1))
    np.testing.assert_allclose(back.log_prob(points), NARROW.log_prob(points), atol=1e-8)


def test_a_quotient_that_is_no_gaussian_is_noticed() -> None:
    g = MixturePosterior(np.ones(1), np.zeros((1, 2)), 0.3 * np.eye(2)[None])
    wide = MixturePosterior(np.array([0.9, 0.1]), np.zeros((2, 2)), np.stack([0.2 * np.eye(2), 0.35 * np.eye(2)]))
    assert divide(wide, g) is None
    proposals = Proposals("gaussian", 2, 0)
    proposals.add(NARROW, np.zeros((0, 2)), np.zeros(0, bool))
    assert proposals.corrected(MixturePosterior(np.ones(1), np.zeros((1, 2)), 3 * np.eye(2)[None])) is None
    under_prior = proposals.log_weights(np.random.default_rng(0).random((10, 2)), under_prior=True)
    assert under_prior is not None
    assert np.isfinite(under_prior).all()


def test_a_flat_posterior_is_proposed_from_the_whole_box() -> None:
    flat: Posterior = MixturePosterior(np.ones(1), np.zeros((1, 3)), np.eye(3)[None])
    assert Region(flat, np.random.default_rng(0)).volume == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(around(flat, np.random.default_rng(0)).cholesky[0], np.eye(3), atol=1e-9)


def test_later_draws_keep_away_from_where_they_fail() -> None:
    """A posterior half of which lies where nothing can be simulated: far fewer draws are wasted on that half."""
    theta, failed = brittle(120)
    edge = MixturePosterior(np.ones(1), np.array([[float(ndtri(0.75)), 0.0]]), 0.3 * np.eye(2)[None])
    wasted = {}
    for known, tried in (("no", (theta[:0], failed[:0])), ("yes", (theta, failed))):
        proposals = Proposals("truncated", 2, 0)
        proposals.add(edge, *tried)
        wasted[known] = float((proposals.draw(4000)[:, 0] > 0.75).mean())
    print("share of draws that fail, without and with what is known of failures:", wasted)
    assert wasted["no"] > 0.35
    assert wasted["yes"] < 0.5 * wasted["no"]


def test_the_paper_s_preset_comes_with_the_paper_s_proposals() -> None:
    def kind(**estimator: object) -> str:
        table = {"study": {"measurement": "m"}, "scenario": {"name": "fling"}, "simulator": {"name": "mujoco"}}
        return parse_config({**table, "estimator": {"name": "x", **estimator}}, "test").estimator.proposals

    assert kind() == "truncated"
    assert kind(preset="paper") == "gaussian"
    assert kind(preset="paper", proposal="posterior") == "posterior"
