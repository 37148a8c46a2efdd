"""What the measurement could have been if the model were right: noise, and what a refit would take out of it."""

import numpy as np
from scipy.optimize import lsq_linear

from ....core.arrays import FloatArray
from ...noise import Noise

#: Columns of the sensitivity that are so much smaller than the largest are no direction at all.
_NEGLIGIBLE = 1e-9


class NoiseDraws:
    """Noise whose strength and colour are as uncertain as their estimates.

    Args:
        noise: as estimated.
        count: replicates; each has one strength and one colour for all recordings.
        rng: source of both.
    """

    def __init__(self, noise: Noise, count: int, rng: np.random.Generator) -> None:
        self.count, self._noise = count, noise
        self.scale = np.maximum(1.0 + noise.relative_error * rng.normal(size=count), 0.1)
        # of n independent numbers, sd is known to 1/sqrt(2 n) of itself and a correlation r to sqrt((1 - r^2) / n)
        error = np.sqrt(2 * (1 - noise.ar1**2)) * noise.relative_error if noise.ar1 > 0 else 0.0
        self.ar1 = np.clip(noise.ar1 + error * rng.normal(size=count), 0.0, 0.99)

    def at(self, places: FloatArray, rng: np.random.Generator, rows: slice = slice(None)) -> FloatArray:
        """Noise ``(R, T, P, A)`` of the replicates ``rows`` at ``places (T, P, A)``, in units of the estimated sd."""
        scale, ar1 = self.scale[rows], self.ar1[rows]
        if self._noise.shared is not None:
            made = np.stack([self._noise.draw(np.nan_to_num(places), rng) for _ in scale])
            return np.asarray(made * scale[:, None, None, None])
        out = rng.normal(size=(len(scale), *places.shape))
        if ar1.any():
            keep = ar1[:, None, None]
            new = np.sqrt(1 - keep**2)
            for t in range(1, len(places)):
                out[:, t] = keep * out[:, t - 1] + new * out[:, t]
        out *= scale[:, None, None, None]
        return np.asarray(out)


class Refit:
    """Takes out of residuals what parameters and offsets would explain if they were fitted to them, to first order.

    Least squares within the box of the prior. Without it replicates would carry more noise than residuals of a fit.

    Args:
        jacobian: of the residuals ``(N, D)``, by parameters in the unit cube.
        unit: where the parameters are in it ``(D,)``.
        offsets: columns of clock and constant offsets ``(N, K)``, which have no bounds.
    """

    def __init__(self, jacobian: FloatArray, unit: FloatArray, offsets: FloatArray) -> None:
        columns = np.hstack([jacobian, offsets])
        norms = np.linalg.norm(columns, axis=0)
        kept = norms > _NEGLIGIBLE * max(float(norms.max(initial=0.0)), 1e-300)
        free = np.full(offsets.shape[1], np.inf)
        self.low = (np.concatenate([-unit, -free]) * norms)[kept]
        self.high = (np.concatenate([1.0 - unit, free]) * norms)[kept]
        self.basis, self.triangle = np.linalg.qr(columns[:, kept] / norms[kept])
        self.inverse = np.linalg.pinv(self.triangle, rcond=1e-8)

    def __call__(self, rows: FloatArray) -> FloatArray:
        """Residuals ``(R, N)`` after a refit."""
        along = -rows @ self.basis
        solved = along @ self.inverse.T
        outside = ((solved < self.low) | (solved > self.high)).any(axis=1)
        fitted = solved @ self.triangle.T
        for k in np.flatnonzero(outside):
            low, high = np.minimum(self.low, -1e-12), np.maximum(self.high, 1e-12)
            fitted[k] = self.triangle @ lsq_linear(self.triangle, along[k], (low, high)).x
        return np.asarray(rows + fitted @ self.basis.T)
