"""How rough a series is in time: what noise leaves and motion does not."""

from collections.abc import Iterable

import numpy as np

from .arrays import FloatArray


def fourth_differences(x: FloatArray) -> FloatArray:
    """Of ``x (T, ...)``, those that are finite ``(K,)``: white noise of standard deviation s leaves them that same one.

    Smooth motion has next to none.
    """
    d = np.diff(x, n=4, axis=0) / np.sqrt(70.0)
    return np.asarray(d[np.isfinite(d)])


def robust_sd(x: FloatArray) -> float:
    """Standard deviation of normal numbers, whatever a few others among them are; their mean is zero."""
    return float(1.4826 * np.median(np.abs(x)))


def rough_sd(series: Iterable[FloatArray]) -> float:
    """Standard deviation of the noise of several ``(T, ...)`` as their roughness tells it; 0 if all are too short."""
    rough = np.concatenate([fourth_differences(x) for x in series])
    return robust_sd(rough) if len(rough) else 0.0
