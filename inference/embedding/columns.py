"""Columns of numbers for a density to read: standardised, bounded, and those that say something."""

import numpy as np

from ...core.arrays import FloatArray, IntArray

# Beyond this many robust standard deviations a column grows like a logarithm: one wild entry moves nothing else.
_STRAIGHT = 3.0
# A column beyond the training draws' range by more than this part of it is pulled back: no extrapolation.
_MARGIN = 0.1
_LEAST = 1e-9


class Standard:
    """Columns to comparable, bounded ones: robust standardising, squashed tails, no extrapolation.

    Args:
        rows: ``(N, F)`` of the training draws.
    """

    def __init__(self, rows: FloatArray) -> None:
        self.center = np.median(rows, axis=0)
        apart = np.abs(rows - self.center)
        # The 68th percentile is the standard deviation of a Gaussian; where most draws agree, it is zero.
        near, far = np.quantile(apart, 0.68, axis=0), np.sqrt((apart**2).mean(axis=0))
        self.scale = np.where(near > 0.05 * far, near, far)
        size = np.abs(rows).max(axis=0)
        # Less than this is the rounding of numbers in float32.
        self.varies = self.scale > 1e-6 * np.maximum(size, 1e-9)
        self.scale = np.where(self.varies, self.scale, 1.0)
        self.low, self.high = -np.inf, np.inf
        self.mean, self.spread = 0.0, 1.0
        out = self(rows)
        low, high = out.min(axis=0), out.max(axis=0)
        self.low, self.high = low - _MARGIN * (high - low), high + _MARGIN * (high - low)
        self.mean, self.spread = out.mean(axis=0), np.maximum(out.std(axis=0), _LEAST)
        self.spread = np.where(self.varies, self.spread, 1.0)

    low: FloatArray | float
    high: FloatArray | float
    mean: FloatArray | float
    spread: FloatArray | float

    def __call__(self, rows: FloatArray) -> FloatArray:
        """``(B, F)`` to ``(B, F)``; columns that never varied are zero."""
        v = np.where(self.varies, (rows - self.center) / self.scale, 0.0)
        size = np.abs(v)
        v = np.sign(v) * np.where(size < _STRAIGHT, size, _STRAIGHT + np.log1p(np.maximum(size - _STRAIGHT, 0.0)))
        return np.asarray((np.clip(v, self.low, self.high) - self.mean) / self.spread)


def relevant(
    columns: FloatArray, unit: FloatArray, errors: FloatArray | None, weights: FloatArray, most: int
) -> IntArray:
    """Indices, in order, of at most ``most`` columns that go with the parameters beyond chance.

    Looked for are correlations of a column, its square and its size with each parameter, its distance from the middle
    and the product of each pair: what changes a mean, a spread, or has two signs. With errors of a first guess, also
    with their squares: what says how far the guess can be trusted, as the size of a set does. Beyond chance is a
    correlation above ``sqrt(2 log(tests) / N)``, which noise reaches about once in all tests. Columns as few
    as ``most`` are all kept.

    Args:
        columns: ``(N, F)`` standardised; unit: ``(N, D)`` in the unit cube; errors: ``(N, D)``;
            weights: ``(N,)``.
        most: how many to keep.
    """
    if columns.shape[1] <= most:
        return np.arange(columns.shape[1])
    centred = unit - 0.5
    row, column = np.triu_indices(unit.shape[1])
    squares = [] if errors is None else [errors**2]
    aims = np.concatenate([centred, centred[:, row] * centred[:, column], *squares], axis=1)
    kinds = [columns, columns**2, np.abs(columns)]
    strength = np.max([np.abs(_correlation(k, aims, weights)).max(axis=1) for k in kinds], axis=0)
    effective = weights.sum() ** 2 / (weights**2).sum()
    chance = np.sqrt(2.0 * np.log(3 * columns.shape[1] * aims.shape[1]) / effective)
    order = np.argsort(-strength)[:most]
    kept = order[strength[order] > chance]
    return np.sort(kept if len(kept) else order[: most // 2])


def _correlation(a: FloatArray, b: FloatArray, weights: FloatArray) -> FloatArray:
    """``(N, F)`` and ``(N, G)`` to weighted correlations ``(F, G)``; zero with a column that is constant."""
    w = (weights / weights.sum())[:, None]
    a, b = a - (w * a).sum(axis=0), b - (w * b).sum(axis=0)
    scale = np.sqrt((w * a**2).sum(axis=0))[:, None] * np.sqrt((w * b**2).sum(axis=0))
    return np.asarray((w * a).T @ b / np.maximum(scale, 1e-9))
