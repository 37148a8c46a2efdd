"""Random noise of unit variance: correlated in time, and shared by points that are near each other."""

import numpy as np
from scipy.signal import lfilter

from ..core.arrays import FloatArray

#: Waves that a smooth field is the sum of.
_WAVES = 64


def ar1_noise(shape: tuple[int, ...], ar1: float, rng: np.random.Generator) -> FloatArray:
    """AR(1) noise of unit variance along the first axis, ``ar1`` from frame to frame."""
    wild = rng.normal(size=shape)
    wild[1:] *= np.sqrt(1 - ar1**2)
    return np.asarray(lfilter([1.0], [1.0, -ar1], wild, axis=0), float)


def smooth_noise(places: FloatArray, reach: float, ar1: float, rng: np.random.Generator) -> FloatArray:
    """A vector field of unit variance a coordinate at ``places (T, P, A)``, which is Gaussian in the mean over fields.

    Two places at the distance d are off together with the correlation exp(-d^2 / (2 reach^2)), from frame to frame
    times ``ar1``.

    Args:
        places: where it is asked for [unit]; NaN = nowhere.
        reach: of the correlation [unit].
        ar1: correlation from frame to frame.
        rng: source of the field.

    References:
        Rahimi and Recht, *Random features for large-scale kernel machines*, 2007: a field as a sum of random waves.
    """
    frames, _, axes = places.shape
    waves, phases = rng.normal(size=(axes, _WAVES)) / reach, rng.uniform(0.0, 2.0 * np.pi, _WAVES)
    heights = ar1_noise((frames, _WAVES, axes), ar1, rng)
    crests = np.cos((places @ waves + phases).astype(np.float32))  # single precision shows in no noise, and is fast
    return np.asarray(np.sqrt(2.0 / _WAVES) * crests @ heights)
