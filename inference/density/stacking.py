"""Stacking: how much of each density to mix, by what each says of draws that it has not seen."""

import numpy as np
from scipy.special import logsumexp

from ...core.arrays import FloatArray

_ROUNDS = 500


def stack(log_density: FloatArray, weights: FloatArray) -> FloatArray:
    """Weights ``(K,)`` of K densities that maximise the mixture's mean log density on left-out draws.

    The maximum is unique up to densities that agree, and EM finds it: the problem is concave (Yao et al. 2018,
    stacking of predictive distributions).

    Args:
        log_density: ``(N, K)``, each draw's log density under densities trained without it.
        weights: ``(N,)`` of the draws.
    """
    count = log_density.shape[1]
    mixed = np.full(count, 1.0 / count)
    usable = np.nan_to_num(log_density, nan=-1e30, neginf=-1e30)
    for _ in range(_ROUNDS):
        joint = np.log(np.maximum(mixed, 1e-300)) + usable
        share = np.exp(joint - logsumexp(joint, axis=1, keepdims=True))
        before, mixed = mixed, weights @ share / weights.sum()
        if np.abs(mixed - before).max() < 1e-6:
            break
    return np.asarray(mixed / mixed.sum())
