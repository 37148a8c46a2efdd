"""Whether the posterior still moves."""

import math

import numpy as np

from ...core.estimator import Posterior

#: So often in a row a posterior must have moved little: once may be chance.
PATIENCE = 2
_DRAWS = 2000


class Stopping:
    """Ends the rounds once the posterior stops moving.

    Args:
        threshold: what counts as little [standard deviations of the posterior]; 0 never ends them.
        seed: of the draws that measure it.
    """

    def __init__(self, threshold: float, seed: int) -> None:
        self.threshold, self.seed = threshold, seed
        self.moved: list[float] = []
        self._last: Posterior | None = None

    def after(self, posterior: Posterior) -> bool:
        """Whether the round that gave this posterior was the last."""
        if self._last is not None:
            rng = np.random.default_rng([self.seed, len(self.moved), 15_485_863])
            self.moved.append(movement(self._last, posterior, rng))
        self._last = posterior
        return len(self.moved) >= PATIENCE and max(self.moved[-PATIENCE:]) < self.threshold

    def text(self, rounds: int) -> str:
        """Why no more rounds were run than these, of at most ``rounds``."""
        if not self.moved:
            return "one round was asked for, so nothing tells whether more draws would move the posterior"
        moved = f"it moved by {self.moved[-1]:.2g} of its standard deviations in the last round"
        if len(self.moved) + 1 < rounds:
            return f"the posterior stopped moving ({moved}), so that the rest of {rounds} rounds was not needed"
        return (
            f"all that were asked for; the posterior may still move ({moved})"
            if (self.moved[-1] >= self.threshold)
            else f"all that were asked for; the posterior has settled ({moved})"
        )


def movement(before: Posterior, after: Posterior, rng: np.random.Generator) -> float:
    """How far a posterior has moved, in standard deviations.

    The Jensen-Shannon divergence between the two, by draws of both, said as the shift of a Gaussian that has the
    same divergence; it sees a change of width, of shape or of modes as well as one of place. It is finite however
    far apart they are (at most about 5).
    """
    a, b = before.sample(_DRAWS, rng), after.sample(_DRAWS, rng)
    at_a = before.log_prob(a) - after.log_prob(a)
    at_b = after.log_prob(b) - before.log_prob(b)
    # log 2 - log(1 + e^-t) is log(2p / (p + q)) with t = log p/q
    divergence = math.log(2.0) - 0.5 * float(np.mean(np.logaddexp(0.0, -at_a)) + np.mean(np.logaddexp(0.0, -at_b)))
    return _shift(max(divergence, 0.0))


def _shift(divergence: float) -> float:
    """Distance of two unit Gaussians whose Jensen-Shannon divergence [nats] is this one."""
    low, high = 0.0, 5.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _divergence(middle) < divergence else (low, middle)
    return 0.5 * (low + high)


def _divergence(shift: float) -> float:
    nodes, mass = np.polynomial.hermite_e.hermegauss(80)
    t = shift * nodes + 0.5 * shift**2  # log p/q at draws of p
    return math.log(2.0) - float(mass @ np.logaddexp(0.0, -t) / mass.sum())
