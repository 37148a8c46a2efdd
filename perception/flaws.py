"""What a detector does to points: noise, misses, and an order that tells nothing."""

import numpy as np

from ..core.arrays import BoolArray, FloatArray


def flawed(
    points: FloatArray, seen: BoolArray, noise: float, missed: float, permuted: bool, rng: np.random.Generator
) -> FloatArray:
    """Points as they would have been detected.

    Args:
        points: ``(T, K, A)``.
        seen: those that could be, ``(T, K)``.
        noise: standard deviation of every coordinate [unit of the points].
        missed: chance that a point that could be seen is not [1].
        permuted: shuffle the points of every frame.
        rng: source of all of it.

    Returns:
        ``(T, K, A)``, NaN where not seen.
    """
    kept = seen & (rng.random(points.shape[:2]) >= missed)
    found = points + noise * rng.normal(size=points.shape)
    found[~kept] = np.nan
    if not permuted:
        return np.asarray(found)
    order = rng.permuted(np.tile(np.arange(points.shape[1]), (len(points), 1)), axis=1)
    return np.asarray(np.take_along_axis(found, order[..., None], axis=1))
