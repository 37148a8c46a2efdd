r"""How surely a motion tells models apart, from what they predict on it.

Let model m predict :math:`y_m + L_m z` in units of the noise, with z standard normal: the columns of L_m are what one
standard deviation along each principal axis of its posterior changes, and what the offsets of a recording and the
error of its time step may. When model m is refitted to the old recordings and a new one, to first order its residual
sum of squares grows by

.. math:: Q_m = r^T (I + L_m L_m^T)^{-1} r, \qquad r = y - y_m .

If model a is the truth, :math:`y = y_a + L_a z + n`, and the difference :math:`Q_b - Q_a` is a quadratic form in normal
variables, whose mean and variance are known in closed form and whose tail is sampled in the few dimensions where the
models differ.

References:
    Box and Hill (1967), Discrimination among mechanistic models, Technometrics 9: the design criterion.
    Atkinson and Fedorov (1975), The design of experiments for discriminating between two rival models, Biometrika 62:
    the worst rival decides.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from ....core.arrays import FloatArray

#: Draws from which a probability is counted.
DRAWS = 4000
#: A distribution of Q narrower than this decides nothing finer.
_LEAST_SD = 1.0


@dataclass(frozen=True, eq=False)
class View:
    """What one model predicts of one motion.

    Args:
        mean: ``(N,)`` [noise standard deviations].
        spread: ``(N, K)``, what its posterior, its time step and the offsets of a recording may change.
    """

    mean: FloatArray
    spread: FloatArray


def reduced(views: Sequence[View]) -> list[View]:
    """The same in the space that the models and their differences span: outside of it they agree on everything."""
    differences = [v.mean - views[0].mean for v in views[1:]]
    basis, _ = np.linalg.qr(np.column_stack([v.spread for v in views] + differences))
    return [View(basis.T @ (v.mean - views[0].mean), basis.T @ v.spread) for v in views]


def repeated(views: Sequence[View], takes: int) -> list[View]:
    """What ``takes`` recordings of the same motion show, their offsets taken for the same ones."""
    root = np.sqrt(takes)
    return [View(root * v.mean, root * v.spread) for v in views]


def score(views: Sequence[View], leads: FloatArray, thresholds: FloatArray) -> FloatArray:
    """For each pair [truth, rival] how many standard deviations Q is above its threshold on average ``(M, M)``.

    Args:
        views: of the models.
        leads: what the recordings say already, in -2 log likelihood, by truth and rival.
        thresholds: beyond which the truth is named.
    """
    views = reduced(views)
    out = np.full((len(views), len(views)), np.inf)
    for a, truth in enumerate(views):
        known = np.eye(len(truth.mean)) + truth.spread @ truth.spread.T
        for b, rival in enumerate(views):
            if a == b:
                continue
            weigh = _precision(rival.spread)
            away = truth.mean - rival.mean
            form = (weigh - _precision(truth.spread)) @ known
            pull = weigh @ away
            mean = leads[a, b] + away @ pull + np.trace(form)
            sd = np.sqrt(max(2.0 * np.trace(form @ form) + 4.0 * pull @ known @ pull, 0.0))
            out[a, b] = (mean - thresholds[a, b]) / max(sd, _LEAST_SD)
    return out


def named_right(views: Sequence[View], leads: FloatArray, thresholds: FloatArray, seed: int = 0) -> FloatArray:
    """The probability ``(M,)`` for each model that it is ahead of all others by their thresholds if it is the truth.

    Arguments as of :func:`score`.
    """
    rng = np.random.default_rng(seed)
    views = reduced(views)
    weights = [_precision(v.spread) for v in views]
    out = np.zeros(len(views))
    for a, truth in enumerate(views):
        size = len(truth.mean)
        moved = rng.standard_normal((DRAWS, truth.spread.shape[1])) @ truth.spread.T
        noise = rng.standard_normal((DRAWS, size)) + moved
        seen = truth.mean + noise
        ahead = np.ones(DRAWS, bool)
        own = _form(noise, weights[a])
        for b, rival in enumerate(views):
            if b != a:
                ahead &= leads[a, b] + _form(seen - rival.mean, weights[b]) - own > thresholds[a, b]
        out[a] = float(ahead.mean())
    return out


def probability_of(scores: FloatArray) -> FloatArray:
    """The probability that goes with a score if Q were normal: smooth, for comparing motions."""
    return np.asarray(norm.cdf(scores))


def _precision(spread: FloatArray) -> FloatArray:
    """The inverse of I + L L^T."""
    inner = np.eye(spread.shape[1]) + spread.T @ spread
    return np.asarray(np.eye(len(spread)) - spread @ np.linalg.solve(inner, spread.T))


def _form(rows: FloatArray, matrix: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ki,ij,kj->k", rows, matrix, rows))
