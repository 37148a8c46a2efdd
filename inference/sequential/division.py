"""The paper's correction: Gaussian proposals, and a mixture divided by one of them.

Papamakarios & Murray 2016 (NPE-A) and BayesSim (Ramos et al. 2019): where the draws follow a Gaussian g instead of
the prior, the learned mixture is ``q(z | x) ~ g(z) p(x | z)``, and the posterior is ``q N(0, I) / g``, a mixture
again as long as every component stays narrower than g.
"""

import numpy as np

from ...core.arrays import FloatArray
from ...core.estimator import Posterior
from ..posterior.mixture import MixturePosterior, to_latent

#: The proposal's standard deviations are those of the posterior times this, at most the prior's.
WIDER = 3.0
_DRAWS = 4000
#: Smallest precision that a quotient may have, in parts of the proposal's: nearer to zero it is an accident.
_LEAST = 1e-3


def around(posterior: Posterior, rng: np.random.Generator) -> MixturePosterior:
    """One Gaussian in probit coordinates with the posterior's mean and a wider covariance.

    No direction gets wider than the prior, N(0, I): beyond that, draws would pile up on the faces of the cube.
    """
    if isinstance(posterior, MixturePosterior):
        mean = posterior.weights @ posterior.means
        away = posterior.means - mean
        second = posterior.cholesky @ posterior.cholesky.transpose(0, 2, 1) + away[:, :, None] * away[:, None, :]
        covariance = np.einsum("k,kij->ij", posterior.weights, second)
    else:
        z = to_latent(posterior.sample(_DRAWS, rng), 1e-6)
        mean, covariance = z.mean(axis=0), np.atleast_2d(np.cov(z.T))
    values, axes = np.linalg.eigh(WIDER**2 * covariance)
    values = np.clip(values, 1e-12, 1.0)
    return MixturePosterior(np.ones(1), mean[None], np.linalg.cholesky((axes * values) @ axes.T)[None])


def divide(learned: MixturePosterior, proposal: MixturePosterior) -> MixturePosterior | None:
    """The posterior under the prior, of a mixture that was learned from draws of one Gaussian.

    Args:
        learned: mixture in probit coordinates.
        proposal: one component, in the same.

    Returns:
        None where the quotient of a component is no Gaussian: it has left the positive definite cone.
    """
    eye = np.eye(learned.dim)
    g_precision, g_shift, g_log = _natural(proposal.means[0], proposal.cholesky[0])
    kept = np.flatnonzero(learned.weights > 0)
    log_weights, means, factors = [], [], []
    for k in kept:
        precision, shift, log_c = _natural(learned.means[k], learned.cholesky[k])
        precision, shift = precision + eye - g_precision, shift - g_shift
        # in units of the proposal's precision, so that the scale of the parameters does not matter
        relative = np.linalg.eigvalsh(proposal.cholesky[0].T @ precision @ proposal.cholesky[0])
        if relative[0] < _LEAST:
            return None
        covariance = np.linalg.inv(precision)
        mean = covariance @ shift
        means.append(mean)
        factors.append(np.linalg.cholesky((covariance + covariance.T) / 2))
        log_det = float(np.linalg.slogdet(precision)[1])
        log_weights.append(np.log(learned.weights[k]) + log_c - g_log - 0.5 * log_det + 0.5 * float(shift @ mean))
    log_w = np.array(log_weights)
    return MixturePosterior(np.exp(log_w - log_w.max()), np.array(means), np.array(factors))


def _natural(mean: FloatArray, cholesky: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Precision, precision times mean, and the log density at the origin, up to a constant."""
    inverse = np.linalg.inv(cholesky)
    precision = inverse.T @ inverse
    shift = precision @ mean
    return precision, shift, float(-np.log(np.diagonal(cholesky)).sum() - 0.5 * mean @ shift)
