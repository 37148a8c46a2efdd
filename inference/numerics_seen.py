"""How far a model's own numbers are off, told by what they leave, and what is known of parameters then."""

from dataclasses import replace

import numpy as np

from ..core.arrays import FloatArray
from .polish import Objective, Polished

#: How large numerical errors may be, in units of what finer numbers or another engine change; all as likely before.
SIZES = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0)
#: Of a unit vector less than this is rounding.
_ROUNDING = 1e-9
#: Directions of which parameters take up all but this are theirs.
_TAKEN_UP = 1e-3
#: No standard deviation becomes less than this share of what it was.
_NARROWEST = 0.1


def seen_past_numerics(objective: Objective, best: Polished) -> Polished:
    r"""The same fit with the covariance that it has if numerical errors are as large as the residuals show.

    A fit lets the model be off along the directions ``D`` of an objective's discrepancy by about what finer numbers or
    another engine change, as nobody knows before whether reality is off that way. Afterwards the residuals tell: along
    ``D`` they have the covariance :math:`I + t^2 D D'`, and each size t of :data:`SIZES` is as likely as they are under
    it, what parameters take up left out (restricted likelihood: Patterson and Thompson 1971). The estimate is the one
    that was made for t = 1, so its covariance is :math:`A^{-1} J' M J A^{-1}` with the mean ``M`` over those sizes
    (Huber 1967). Recordings without directions leave it as it was.

    Args:
        objective: that was made least.
        best: where, with its derivatives there.
    """
    parts = objective.discrepancy.along(objective.recordings)
    if parts is None:
        return best
    along, sizes = parts
    ratios = np.array([(1.0 + t**2 * sizes**2) / (1.0 + sizes**2) - 1.0 for t in SIZES])
    excess = _likely(along, best, ratios) @ ratios
    root = np.linalg.cholesky(best.covariance)
    moved = along.T @ best.jacobian @ root
    # where derivatives are of chance, too, more could be taken off than there is
    shares, ways = np.linalg.eigh((moved * excess[:, None]).T @ moved)
    widths = root @ ways * np.sqrt(1.0 + np.maximum(shares, _NARROWEST**2 - 1.0))
    return replace(best, covariance=np.asarray(widths @ widths.T, float))


def _likely(along: FloatArray, best: Polished, ratios: FloatArray) -> FloatArray:
    """How likely each of :data:`SIZES` is ``(S,)``, of which ``ratios (S, K)`` are variances less one."""
    left, values, _ = np.linalg.svd(best.jacobian, full_matrices=False)
    taken = left[:, values > _ROUNDING * values.max(initial=0.0)]
    free = along - taken @ (taken.T @ along)
    shares, ways = np.linalg.eigh(free.T @ free)
    seen = shares > _TAKEN_UP
    basis = free @ ways[:, seen] / np.sqrt(shares[seen])
    numbers, mixed = basis.T @ best.white, basis.T @ along
    logs = []
    for ratio in ratios:
        covariance = np.eye(len(numbers)) + (mixed * ratio) @ mixed.T
        _, size = np.linalg.slogdet(covariance)
        logs.append(-0.5 * (numbers @ np.linalg.solve(covariance, numbers) + size))
    weights = np.exp(np.array(logs) - np.max(logs))
    return np.asarray(weights / weights.sum())
