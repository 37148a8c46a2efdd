"""Moments of the set of points of every frame: where it is, how large, how it lies, how many there are."""

import numpy as np

from ...core.arrays import BoolArray, FloatArray

# A spread below this part of the points' scale is read as this much, so that its logarithm exists.
_LEAST = 1e-4


def moments(points: FloatArray, seen: BoolArray) -> FloatArray:
    """``(N, T, P, A)`` points and masks ``(N, T, P)`` to ``(N, T, 2 A + A (A - 1) / 2 + 2)``.

    Mean, log standard deviation and Fisher's z of the correlations, then log n and 1/sqrt(n) of the number of points
    seen, which say how far the rest can be trusted; what few points do not determine is zero. Nearly sufficient where
    points are draws from a distribution. The same whatever the order of the points, up to rounding.
    """
    mask = seen[..., None]
    count = seen.sum(axis=2)[..., None]
    size = np.maximum(count, 1)
    mean = np.where(mask, points, 0.0).sum(axis=2) / size
    apart = np.where(mask, points - mean[:, :, None], 0.0)
    covariance = np.einsum("ntpa,ntpb->ntab", apart, apart) / size[..., None]
    spread = np.sqrt(np.maximum(np.diagonal(covariance, axis1=2, axis2=3), _LEAST**2))
    parts = [mean, np.where(count > 1, np.log(spread), 0.0)]
    row, column = np.triu_indices(points.shape[3], 1)
    if len(row):
        correlation = covariance[..., row, column] / (spread[..., row] * spread[..., column])
        parts.append(np.where(count > 2, np.arctanh(np.clip(correlation, -0.999, 0.999)), 0.0))
    half = np.maximum(count, 0.5)
    return np.concatenate([*parts, np.log(half), 1.0 / np.sqrt(half)], axis=2)
