"""Directions in which a right model may still be off: what a smaller step or another engine would change."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..core.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """Low-rank error of the model beside the noise: residuals are ``D a + noise`` with ``a ~ N(0, I)``.

    White residuals then have the covariance ``I + D D'``. Whitening by it takes off what lies along the directions,
    as far as their amplitudes are free to explain it, and leaves everything else as it is (model discrepancy as a
    nuisance: Kennedy and O'Hagan 2001, with the directions told by computer experiments).

    Args:
        directions: ``D``, ``(N_r, K)`` a recording, in units of the noise; recordings without any may be missing.
    """

    directions: Mapping[str, FloatArray]

    @cached_property
    def _factors(self) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Left singular vectors and singular values, a recording."""
        return {name: np.linalg.svd(d, full_matrices=False)[:2] for name, d in self.directions.items()}

    def whitened(self, recording: str, white: FloatArray) -> FloatArray:
        """``(I + D D')^-1/2`` times white residuals ``(N_r,)``."""
        if recording not in self.directions:
            return white
        u, s = self._factors[recording]
        return np.asarray(white + u @ ((1.0 / np.sqrt(1.0 + s**2) - 1.0) * (u.T @ white)))

    def explained(self, recording: str, whitened: FloatArray) -> float:
        """What the most probable amplitudes explain ``|D a|^2`` [noise variances], given whitened residuals."""
        if recording not in self.directions:
            return 0.0
        u, s = self._factors[recording]
        # a = V s / sqrt(1 + s^2) U' v, and D a = U s V' a
        return float(np.sum((s**2 / np.sqrt(1.0 + s**2) * (u.T @ whitened)) ** 2))


NONE = Discrepancy({})
