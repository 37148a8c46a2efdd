"""Where the draws of each round come from, and how that is corrected for."""

from typing import Literal, Protocol

import numpy as np
from scipy.special import logsumexp

from ...core.arrays import BoolArray, FloatArray
from ...core.estimator import Posterior
from ..posterior.mixture import MixturePosterior
from .division import around, divide
from .ellipsoid import WIDER, Ellipsoid
from .region import Region
from .success import Success

Kind = Literal["truncated", "posterior", "gaussian"]

#: Share of every later round's proposal that is still the prior: what an early posterior has missed is found again.
DEFENSIVE = 0.2
#: A Gaussian has a thousandth beyond where an ellipsoid is made wider; a posterior with more than this goes on there.
RIM = 0.05
#: Draws of a posterior that an ellipsoid is put around.
ELLIPSOID_DRAWS = 4000
#: Draws that measure how often a proposal is accepted by the success model.
_DRAWS = 20_000


class Density(Protocol):
    """What can be drawn from and evaluated on the unit cube."""

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray: ...

    def log_prob(self, unit: FloatArray) -> FloatArray: ...


class Proposal:
    """Of one later round: a density with a share of the prior, thinned where draws are likely to fail.

    A draw is kept with the probability that it can be simulated, so the density is the product of the two over
    their mean, which is measured.

    Args:
        core: where the posterior is.
        success: None where nothing is known of failures.
        rng: of what measures the mean.
        defensive: share of the prior.
    """

    def __init__(
        self, core: Density, success: Success | None, rng: np.random.Generator, defensive: float = DEFENSIVE
    ) -> None:
        self._core, self._success, self._defensive, self._log_mean = core, success, defensive, 0.0
        if success is not None:
            self._log_mean = float(np.log(success.probability(self._plain(_DRAWS, rng)).mean()))

    def plain(self, unit: FloatArray) -> FloatArray:
        """Log density ``(N,)`` before it is thinned."""
        if not self._defensive:
            return self._core.log_prob(unit)
        rest = np.log(1 - self._defensive) + self._core.log_prob(unit)
        return np.asarray(np.logaddexp(np.log(self._defensive), rest))

    def _plain(self, count: int, rng: np.random.Generator) -> FloatArray:
        core = self._core.sample(count, rng)
        take = rng.random(count) >= self._defensive
        return np.asarray(np.where(take[:, None], core, rng.random(core.shape)))

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        """``(count, D)`` draws."""
        if self._success is None:
            return self._plain(count, rng)
        parts: list[FloatArray] = []
        while sum(map(len, parts)) < count:
            draws = self._plain(2 * count, rng)
            parts.append(draws[rng.random(len(draws)) < self._success.probability(draws)])
        return np.concatenate(parts)[:count]

    def log_prob(self, unit: FloatArray) -> FloatArray:
        """Log density ``(N,)`` inside the unit cube."""
        log_p = self.plain(unit)
        if self._success is not None:
            log_p = log_p + np.log(self._success.probability(unit)) - self._log_mean
        return log_p


class Proposals:
    """The proposals of all rounds so far, and the prior under which the next posterior is learned.

    Draws of all rounds are kept, and follow the mixture p~ of all proposals (equally many a round). A draw weighs
    ``t / p~`` (balance heuristic, Veach & Guibas 1995; the mixture as a whole, so one badly placed round does no
    harm), which makes the draws follow the density t, under which the next posterior is learned:

    - ``"truncated"``: t is the latest proposal itself, uniform on the region that holds the latest posterior and on
      the rest of the box. All draws weigh about the same, and what is learned is the posterior as it is within the
      region, up to the mass that t has taken from outside: a thousandth by the latest posterior's own account, and
      where that was wrong the next region grows there. Where the region is an ellipsoid that was held against the
      model (:mod:`.narrowing`) nothing is drawn outside, and draws there count no more: few draws that lie far off
      tell a regression more than many near ones, and of another place. Later rounds draw from an ellipsoid around the
      latest posterior;
    - ``"posterior"``: t is the prior, and draws come from the latest posterior itself;
    - ``"gaussian"``: t is a Gaussian around the latest posterior, and the learned mixture is divided by it; where
      that leaves the positive definite cone it is learned anew with t the prior, which is also taken where the
      estimator learns no mixture.

    Args:
        kind: as above.
        dim: D.
        seed: of everything random.
    """

    def __init__(self, kind: Kind, dim: int, seed: int) -> None:
        self.kind, self.dim, self.seed = kind, dim, seed
        self._later: list[Proposal] = []
        self._divisor: MixturePosterior | None = None
        self.region: Ellipsoid | None = None  # that the latest round draws from, if it does

    def draw(self, count: int) -> FloatArray:
        """``(count, D)`` draws of the next round; the first round's come from the prior."""
        rng = np.random.default_rng([self.seed, len(self._later)])
        return self._later[-1].sample(count, rng) if self._later else rng.random((count, self.dim))

    def add(self, latest: Posterior, theta: FloatArray, failed: BoolArray, within: Ellipsoid | None = None) -> None:
        """A round has ended: the next one's draws come from about its posterior.

        Args:
            latest: posterior of the round.
            theta: of all draws tried so far ``(N, D)``.
            failed: which of them failed ``(N,)``.
            within: what is known to hold the posterior, for truncated proposals.
        """
        rng = np.random.default_rng([self.seed, len(self._later), 104_729])
        core: Density = latest
        if self.kind == "truncated":
            if within is None and self.region is not None:
                within = Ellipsoid.around(latest.sample(ELLIPSOID_DRAWS, rng), rng)
            core = Region(latest, rng) if within is None else within
            self.region = within
        elif self.kind == "gaussian":
            core = around(latest, rng)
            self._divisor = core if isinstance(latest, MixturePosterior) else None
        share = DEFENSIVE if self.region is None else 0.0
        self._later.append(Proposal(core, Success.learned(theta, failed), rng, share))

    def log_weights(self, theta: FloatArray, *, under_prior: bool = False) -> FloatArray | None:
        """log t / p~ of draws ``(N, D)``; None in the first round, whose draws follow the prior.

        Args:
            theta: draws, all of them inside the unit cube.
            under_prior: take the prior for t.
        """
        if not self._later:
            return None
        each = [np.zeros(len(theta)), *(p.log_prob(theta) for p in self._later)]
        mixture = np.asarray(logsumexp(each, axis=0)) - np.log(len(each))
        if self._divisor is not None and not under_prior:
            return np.asarray(self._divisor.log_prob(theta) - mixture)
        if self.kind == "truncated" and not under_prior:
            return np.asarray(self._later[-1].plain(theta) - mixture)
        return np.asarray(-mixture)

    def counting(self, theta: FloatArray) -> int:
        """How many of the draws ``(N, D)`` weigh anything."""
        log_weights = self.log_weights(theta)
        return len(theta) if log_weights is None else int(np.isfinite(log_weights).sum())

    def at_the_rim(self, samples: FloatArray, rounds: int) -> list[str]:
        """A sentence if the posterior of the last round may reach beyond where that drew from.

        Args:
            samples: of it ``(S, D)``.
            rounds: so many were asked for.
        """
        share = 0.0 if self.region is None else float(np.mean(self.region.out(samples) > 1.0 / WIDER))
        if share < RIM:
            return []
        return [
            f"{100 * share:.0f} % of the posterior lie at the rim of where the last round was drawn from, so that more "
            f"may lie beyond; another round looks there: [estimator] rounds = {rounds + 1}"
        ]

    def corrected(self, learned: Posterior) -> Posterior | None:
        """The posterior under the prior; None where it must be learned anew with the weights of the prior."""
        if self._divisor is None:
            return learned
        return divide(learned, self._divisor) if isinstance(learned, MixturePosterior) else None
