"""Where the draws of each round come from, and how that is corrected for."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.estimator import Posterior

#: Share of every later round's proposal that is still the prior. It bounds the importance weights
#: p / p~ by the inverse of the prior's share of all draws.
DEFENSIVE = 0.2


def propose(density: list[Posterior], count: int, dimension: int, rng: np.random.Generator) -> FloatArray:
    """Round 0 from the prior; later ones from the latest posterior, with a share of the prior."""
    prior = rng.random((count, dimension))
    if not density:
        return prior
    take = rng.random(count) >= DEFENSIVE
    return np.asarray(np.where(take[:, None], density[-1].sample(count, rng), prior))


def log_weights(theta: FloatArray, proposals: list[Posterior]) -> FloatArray:
    """log p / p~, with p~ the mixture of the proposals of all rounds (balance heuristic).

    p is one on the unit cube. Every proposal is a density on the cube, so nothing leaves the positive
    definite cone as it does when Gaussians are divided.
    """
    share = np.ones(len(theta))  # round 0: the prior
    for proposal in proposals:
        share += DEFENSIVE + (1 - DEFENSIVE) * np.exp(proposal.log_prob(theta))
    return np.asarray(-np.log(share / (1 + len(proposals))))
