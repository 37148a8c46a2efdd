"""Linear interpolation in time, the one way it is done everywhere."""

import numpy as np

from .arrays import FloatArray


def interpolate(when: FloatArray, time: FloatArray, values: FloatArray) -> FloatArray:
    """Values at other times, linear in between and held before the first and after the last.

    Args:
        when: ``(K,)`` [s].
        time: ``(T,)`` [s], rising.
        values: ``(T, ...)``; NaN spreads to what lies beside it.

    Returns:
        ``(K, ...)``.
    """
    if len(time) == 1:
        return np.repeat(values, len(when), axis=0)
    inside = np.clip(when, time[0], time[-1])
    right = np.clip(np.searchsorted(time, inside, side="right"), 1, len(time) - 1)
    share = (inside - time[right - 1]) / (time[right] - time[right - 1])
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    # a frame that is hit exactly does not see its neighbour, which may be NaN
    low, high = values[right - 1], values[right]
    return np.asarray(np.where(share == 0, low, np.where(share == 1, high, low + share * (high - low))))
