"""The first guess: sparse linear regression with left-out errors, and their covariance."""

from dataclasses import dataclass

import numpy as np

from ...core.arrays import FloatArray

_ROUNDS = 60
_FOLDS = 5
_PRECISION = (1e-6, 1e8)


@dataclass(frozen=True, eq=False)
class SparseRegression:
    """``y = offset + f B + error``, fitted by evidence, so that features of no use get no weight.

    Automatic relevance determination (MacKay 1994; Tipping 2001): every coefficient has a Gaussian prior of its own,
    whose precision maximises the evidence. The errors are those of regressions that never saw the draw, precisions
    included: the closed form for one draw left out takes the precisions as given, and where there are about as many
    features as draws it promises a tenth of the errors that new draws have.

    Args:
        offset: ``(D,)``; coefficients: ``(F, D)``.
        residual: ``(N, D)`` left-out errors of the training draws.
    """

    offset: FloatArray
    coefficients: FloatArray
    residual: FloatArray

    @classmethod
    def fit(cls, features: FloatArray, z: FloatArray, weights: FloatArray) -> "SparseRegression":
        """From ``(N, F)`` features, ``(N, D)`` targets and ``(N,)`` weights."""
        residual = np.zeros_like(z)
        fold = np.arange(len(z)) % _FOLDS
        for k in range(_FOLDS):
            kept = fold != k
            offset, coefficients = _line(features[kept], z[kept], weights[kept])
            residual[~kept] = z[~kept] - offset - features[~kept] @ coefficients
        return cls(*_line(features, z, weights), residual)

    def mean(self, features: FloatArray) -> FloatArray:
        """``(B, F)`` features to ``(B, D)``."""
        return self.offset + features @ self.coefficients


def _line(features: FloatArray, z: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Offset ``(D,)`` and coefficients ``(F, D)``."""
    weights = weights / weights.mean()
    root = np.sqrt(weights)[:, None]
    offset = (weights[:, None] * z).mean(axis=0)
    center = (weights[:, None] * features).mean(axis=0)
    rows, aim = root * (features - center), root * (z - offset)
    gram = rows.T @ rows
    coefficients = np.stack([_relevance(rows, gram, aim[:, j]) for j in range(z.shape[1])], axis=1)
    return np.asarray(offset - center @ coefficients), coefficients


def _relevance(rows: FloatArray, gram: FloatArray, y: FloatArray) -> FloatArray:
    """Coefficients ``(F,)`` of one target."""
    draws, count = rows.shape
    aim, total = rows.T @ y, float(y @ y)
    variance = max(total / draws, 1e-12)
    alpha, beta = np.full(count, 1.0 / variance), 2.0 / variance
    mean = np.zeros(count)
    for _ in range(_ROUNDS):
        spread = np.linalg.inv(beta * gram + np.diag(alpha))
        before, mean = mean, beta * spread @ aim
        known = 1.0 - alpha * np.diagonal(spread)
        alpha = np.clip(known / np.maximum(mean**2, 1e-12), *_PRECISION)
        error = max(total - 2.0 * mean @ aim + mean @ gram @ mean, 1e-6 * total, 1e-12)
        beta = max(draws - known.sum(), 1.0) / error
        if np.abs(mean - before).max(initial=0.0) < 1e-5:
            break
    return mean


def shrunk_factor(errors: FloatArray, weights: FloatArray) -> FloatArray:
    """Cholesky factor ``(D, D)`` of the covariance of ``(N, D)`` errors, about zero.

    The correlations are drawn towards zero as far as they are uncertain (Schaefer and Strimmer 2005).
    """
    draws, dim = errors.shape
    scale = np.maximum(np.sqrt((weights[:, None] * errors**2).mean(axis=0)), 1e-6)
    unit = np.sqrt(weights)[:, None] * errors / scale
    correlation = unit.T @ unit / draws
    products = unit[:, :, None] * unit[:, None, :]
    uncertainty = products.var(axis=0) / max(draws - 1, 1)
    off = ~np.eye(dim, dtype=bool)
    signal = (correlation[off] ** 2).sum()
    keep = 1.0 - min(1.0, uncertainty[off].sum() / signal) if signal > 0 else 0.0
    # Never wholly singular, so that errors along every direction have a density.
    shrunk = np.where(off, min(keep, 1.0 - 1e-6) * correlation, 1.0)
    return np.asarray(np.linalg.cholesky(scale[:, None] * shrunk * scale), float)
