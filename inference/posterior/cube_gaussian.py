"""A Gaussian on the unit cube as a posterior: mean and covariance given, mass only within the prior's bounds."""

import numpy as np
from scipy.special import ndtr, ndtri

from ...core.arrays import FloatArray
from .mixture import MixturePosterior

# Halvings by which the standard deviation in probit coordinates is found.
_STEPS = 40
# It lies between these. At one the density is flat; beyond, it would rise towards the bounds.
_NARROW, _WIDE = 1e-4, 1.0
# A mean nearer to a bound than this many standard deviations is moved to there: so near lies that of a density that
# falls exponentially from the bound, and a nearer one would need a spike on it.
_NEAREST = 1.0
# Means are kept this far from the bounds, and eigenvalues of a correlation matrix above it.
_FLOOR = 1e-6


def cube_gaussian(mean: FloatArray, covariance: FloatArray) -> MixturePosterior:
    """The Gaussian in probit coordinates whose marginals on the unit cube have the given means and deviations.

    A Gaussian simply cut at the prior's bounds would have its mean pushed inwards, though the prediction of a
    regression already is the mean of what lies within them. With ``z ~ N(a, b^2)`` and ``u = Phi(z)`` the mean is
    ``Phi(a / sqrt(1 + b^2))``, which gives a, and b is found by bisection. The uniform marginal (mean 1/2, standard
    deviation ``12^-1/2``) is met exactly, a narrow one is a Gaussian; correlations are kept.

    Args:
        mean: ``(D,)``; within the cube, or as near to its bounds as one standard deviation.
        covariance: ``(D, D)``, positive diagonal.
    """
    sd = np.sqrt(np.diagonal(covariance))
    edge = np.clip(_NEAREST * sd, _FLOOR, 0.5)
    center = ndtri(np.clip(mean, edge, 1.0 - edge))
    nodes, mass = np.polynomial.hermite_e.hermegauss(64)
    mass = mass / mass.sum()
    low, high = np.full_like(sd, _NARROW), np.full_like(sd, _WIDE)
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        values = ndtr((center * np.sqrt(1.0 + middle**2))[:, None] + middle[:, None] * nodes)
        variance = (values**2) @ mass - (values @ mass) ** 2
        wider = variance < sd**2
        low, high = np.where(wider, middle, low), np.where(wider, high, middle)
    scale = 0.5 * (low + high)
    values, vectors = np.linalg.eigh(covariance / np.outer(sd, sd))
    correlation = (vectors * np.maximum(values, _FLOOR)) @ vectors.T
    factor = scale[:, None] * np.linalg.cholesky(correlation)
    return MixturePosterior(np.ones(1), (center * np.sqrt(1.0 + scale**2))[None], factor[None])
