"""Simulators whose posteriors are known, and estimators trained on them."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...arrays import FloatArray
from ...estimator import PosteriorEstimator

MakeEstimator = Callable[[], PosteriorEstimator]

_FRAMES, _POINTS, _AXES = 4, 5, 2


@dataclass(frozen=True, eq=False)
class LinearGaussian:
    """Points that move linearly with two parameters under white noise; the posterior is known.

    ``x = rest + J u + e``, ``e ~ N(0, noise^2)``, prior uniform on the unit square. In the inner region the bounds
    cut nothing off, so the posterior is Gaussian with covariance ``noise^2 (J^T J)^-1``, set here to standard
    deviations of 0.05 and 0.1 with correlation 0.5.
    """

    jacobian: FloatArray
    rest: FloatArray
    noise: float
    covariance: FloatArray

    @classmethod
    def make(cls, seed: int = 7) -> "LinearGaussian":
        rng = np.random.default_rng(seed)
        noise = 0.02
        covariance = np.array([[0.05**2, 0.5 * 0.05 * 0.1], [0.5 * 0.05 * 0.1, 0.1**2]])
        basis, _ = np.linalg.qr(rng.standard_normal((_FRAMES * _POINTS * _AXES, 2)))
        jacobian = noise * basis @ np.linalg.cholesky(np.linalg.inv(covariance)).T
        spot = np.stack([np.arange(_POINTS) * 0.5, np.arange(_POINTS) % 2 * 0.5], axis=1)
        return cls(jacobian, np.broadcast_to(spot, (_FRAMES, _POINTS, _AXES)).copy(), noise, covariance)

    def simulate(self, theta: FloatArray, rng: np.random.Generator) -> FloatArray:
        """``(N, 2)`` parameters to ``(N, T, P, A)`` points."""
        shift = (theta @ self.jacobian.T).reshape(len(theta), *self.rest.shape)
        return np.asarray(self.rest + shift + self.noise * rng.standard_normal(shift.shape))

    def draws(self, count: int, seed: int) -> tuple[FloatArray, list[FloatArray]]:
        """Draws from the prior."""
        rng = np.random.default_rng(seed)
        theta = rng.random((count, 2))
        return theta, [self.simulate(theta, rng)]

    def exact_mean(self, x: FloatArray) -> FloatArray:
        """``(2,)`` posterior mean where the bounds cut nothing off: the least-squares estimate."""
        return np.asarray(np.linalg.lstsq(self.jacobian, (x - self.rest).ravel(), rcond=None)[0])


@dataclass(frozen=True)
class Cloud:
    """One frame of points scattered about a centre, whose two coordinates are the parameters.

    ``x_p ~ N(u, scatter^2)``, prior uniform on the unit square. Their order says nothing, and the posterior is a
    normal about their mean with standard deviation ``scatter / sqrt(P)``, cut at the bounds.
    """

    scatter: float = 0.3

    def simulate(self, theta: FloatArray, points: int, rng: np.random.Generator) -> FloatArray:
        """``(N, 2)`` parameters to ``(N, 1, P, 2)`` points."""
        return np.asarray(theta[:, None, None] + self.scatter * rng.standard_normal((len(theta), 1, points, 2)))

    def exact(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean ``(2,)`` and standard deviation ``(2,)`` of the posterior given points ``(1, P, 2)``, NaN = not seen."""
        centre, sd = np.nanmean(x[0], axis=0), self.scatter / math.sqrt(np.isfinite(x[0, :, 0]).sum())
        moments = [_truncated(float(c), sd) for c in centre]
        return np.array([m for m, _ in moments]), np.array([s for _, s in moments])


def _truncated(mean: float, sd: float) -> tuple[float, float]:
    """Mean and standard deviation of a normal cut to the unit interval (closed form)."""
    low, high = -mean / sd, (1.0 - mean) / sd
    first, last = (math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi) for z in (low, high))
    mass = 0.5 * (math.erf(high / math.sqrt(2.0)) - math.erf(low / math.sqrt(2.0)))
    shift = (first - last) / mass
    variance = 1.0 + (low * first - high * last) / mass - shift**2
    return mean + sd * shift, sd * math.sqrt(variance)


def fitted(make: MakeEstimator, count: int = 60, seed: int = 0) -> tuple[PosteriorEstimator, list[FloatArray]]:
    """An estimator trained on draws of the linear case, and the first of them as a measurement."""
    theta, x = LinearGaussian.make().draws(count, 1)
    estimator = make()
    estimator.fit(theta, x, seed=seed)
    return estimator, [a[0] for a in x]
