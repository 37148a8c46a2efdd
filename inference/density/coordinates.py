"""Coordinates on R^D in which densities on the unit cube are learned: one-to-one, so support and mass are exact."""

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, ndtri, ndtri_exp

from ...core.arrays import FloatArray

#: Kinds of coordinates: about nothing; about a first guess, as wide as its errors; or narrow, and so straight nearly
#: up to the faces, for posteriors of sharp shapes that no first guess finds.
NAMES = ("probit", "box", "straight")
#: The widest scale of those that are straight.
STRAIGHT = 0.05
# A coordinate nearer to a face of the cube than this is read as lying this far inside.
_EDGE = 1e-12
# A first guess further outside than this is moved here.
_OUTSIDE = 0.25


@dataclass(frozen=True, eq=False)
class Coordinates:
    """``u = F(z)``, one parameter at a time, F such that a standard normal z is a normal cut to the unit interval.

    ``T(u) = (Phi((u - m) / s) - Phi(-m / s)) / (Phi((1 - m) / s) - Phi(-m / s))`` is the distribution function of
    ``N(m, s^2)`` cut to the interval, and ``z = Phi^-1(T(u))``. Away from the faces z is ``(u - m) / s``, so a
    posterior keeps its shape wherever in the box it lies; at a face a normal z is a normal that is cut off there. With
    infinite s this is the probit, ``z = Phi^-1(u)``, in which the uniform prior is one Gaussian: made for parameters
    with Gaussian priors, whose standardised value z then is.

    Args:
        mean: ``(..., D)``; scale: ``(D,)`` above zero, or infinite.
    """

    mean: FloatArray
    scale: FloatArray

    @classmethod
    def about(cls, mean: FloatArray, scale: FloatArray) -> "Coordinates":
        """With means far outside moved nearer: there, nothing more is said by how far they are."""
        return cls(np.clip(mean, -_OUTSIDE, 1.0 + _OUTSIDE), scale)

    @classmethod
    def probit(cls, dim: int) -> "Coordinates":
        """Those about nothing."""
        return cls(np.full(dim, 0.5), np.full(dim, np.inf))

    def _bounds(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Both faces in standard deviations, and log of the mass between them."""
        low, high = -self.mean / self.scale, (1.0 - self.mean) / self.scale
        return low, high, _log_between(low, high)

    def to_latent(self, unit: FloatArray, edge: float = _EDGE) -> FloatArray:
        """``(N, D)``; points nearer to a face than ``edge`` are taken to lie that far inside."""
        u = np.clip(np.asarray(unit, float), edge, 1.0 - edge)
        flat = np.isinf(self.scale)
        with np.errstate(invalid="ignore", divide="ignore"):
            low, high, mass = self._bounds()
            t = (u - self.mean) / self.scale
            left, right = _log_between(low, t) - mass, _log_between(t, high) - mass
        # The smaller of the two tails is the one that is known precisely.
        z = np.where(left < right, ndtri_exp(np.minimum(left, 0.0)), -ndtri_exp(np.minimum(right, 0.0)))
        return np.asarray(np.where(flat, ndtri(u), z))

    def to_unit(self, z: FloatArray) -> FloatArray:
        """``(N, D)`` on the real line to the open unit cube."""
        flat = np.isinf(self.scale)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            low, high, mass = self._bounds()
            left, right = log_ndtr(z) + mass, log_ndtr(-z) + mass
            # Phi(t) = Phi(low) + part of the mass; from the upper side where that is the smaller number.
            up = ndtri_exp(np.minimum(np.logaddexp(log_ndtr(low), left), 0.0))
            down = -ndtri_exp(np.minimum(np.logaddexp(log_ndtr(-high), right), 0.0))
            cut = self.mean + self.scale * np.where(up < 0, up, down)
        u = np.where(flat, np.exp(log_ndtr(z)), cut)
        return np.asarray(np.clip(u, np.finfo(float).tiny, 1.0 - np.finfo(float).epsneg), float)

    def log_slope(self, unit: FloatArray, z: FloatArray) -> FloatArray:
        """``log dz/du``, entry by entry, at points and their latent ones."""
        flat = np.isinf(self.scale)
        with np.errstate(invalid="ignore", divide="ignore"):
            t = (np.asarray(unit, float) - self.mean) / self.scale
            cut = -0.5 * t**2 - np.log(self.scale) - self._bounds()[2]
        # A normal's own constant is in both densities, but for the flat one.
        return np.asarray(np.where(flat, 0.5 * np.log(2.0 * np.pi), cut) + 0.5 * z**2)

    @property
    def key(self) -> bytes:
        """Equal for equal coordinates."""
        return self.mean.tobytes() + self.scale.tobytes()


def _log_between(low: FloatArray, high: FloatArray) -> FloatArray:
    """``log(Phi(high) - Phi(low))`` for ``low <= high``, from the side where both are small."""
    flip = low + high > 0
    a, b = np.where(flip, -high, low), np.where(flip, -low, high)
    first, last = log_ndtr(b), log_ndtr(a)
    with np.errstate(divide="ignore"):
        return np.asarray(first + np.log(-np.expm1(np.minimum(last - first, 0.0))))


def fitted_scale(mean: FloatArray, unit: FloatArray, weights: FloatArray) -> FloatArray:
    """``(D,)`` scales of greatest likelihood of ``unit (N, D)`` about ``mean (N, D)``; infinite where flat is best."""
    spread = np.sqrt((weights[:, None] * (unit - mean) ** 2).mean(axis=0)) + 1e-6
    best, scale = np.zeros(unit.shape[1]), np.full(unit.shape[1], np.inf)
    for factor in np.geomspace(0.5, 8.0, 25):
        tried = Coordinates.about(mean, factor * spread)
        log_p = tried.log_slope(unit, np.zeros_like(unit))
        score = (weights[:, None] * (log_p - 0.5 * np.log(2.0 * np.pi))).mean(axis=0)
        better = score > best
        best, scale = np.where(better, score, best), np.where(better, factor * spread, scale)
    return np.asarray(scale)
