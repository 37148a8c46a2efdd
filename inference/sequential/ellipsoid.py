"""An ellipsoid in the unit cube, and the uniform density on what the cube holds of it."""

import numpy as np
from scipy.special import gammaln
from scipy.stats import chi2

from ...core.arrays import FloatArray

#: Mass of a Gaussian that is left outside its own ellipsoid, before that is made wider.
TAIL = 1e-3
#: An ellipsoid is longer than that by this factor, along every axis: few posteriors are quite Gaussian.
WIDER = 1.5
#: Points that measure how much of an ellipsoid the cube holds.
_POINTS = 40_000


def inner_radius(dim: int) -> float:
    """Radius of the ball that holds all but :data:`TAIL` of a standard normal density in ``dim`` dimensions."""
    return float(np.sqrt(chi2.ppf(1.0 - TAIL, dim)))


class Ellipsoid:
    """The uniform density on an ellipsoid, as far as that lies in the unit cube.

    Args:
        center: ``(D,)``.
        axes: what makes it of the unit ball ``(D, D)``: half of its principal axes as columns, or these turned.
        rng: of the points that measure its volume.
    """

    def __init__(self, center: FloatArray, axes: FloatArray, rng: np.random.Generator) -> None:
        self.center, self._axes, self._inverse = center, axes, np.linalg.inv(axes)
        dim = len(center)
        points = self._in_ball(_POINTS, rng)
        self.share = max(1, int(_in_cube(points).sum())) / _POINTS  # of it that lies in the cube
        ball = 0.5 * dim * np.log(np.pi) - float(gammaln(0.5 * dim + 1.0))
        self.log_volume = ball + float(np.linalg.slogdet(axes)[1]) + float(np.log(self.share))

    @classmethod
    def around(cls, draws: FloatArray, rng: np.random.Generator) -> "Ellipsoid":
        """The one that holds ``draws (N, D)`` of a posterior, but for :data:`TAIL` if that is Gaussian."""
        values, axes = np.linalg.eigh(np.atleast_2d(np.cov(draws.T)))
        half = WIDER * inner_radius(draws.shape[1]) * np.sqrt(np.maximum(values, 1e-12))
        return cls(draws.mean(axis=0), axes * half, rng)

    def stretched(self, to: FloatArray, rng: np.random.Generator) -> "Ellipsoid":
        """A small one that holds this and as much again around another point ``(D,)``.

        The sum of an ellipsoid and a line between its copies lies in one of the matrix ``(1 + 1/p) Q + (1 + p) h h'``
        for every p > 0; the least volume is next to p = D - 1 where they are far apart (Kurzhanski and Valyi,
        *Ellipsoidal calculus*, 1997).
        """
        p, half = max(1.0, len(to) - 1.0), 0.5 * (to - self.center)
        matrix = (1.0 + 1.0 / p) * self._axes @ self._axes.T + (1.0 + p) * np.outer(half, half)
        return Ellipsoid(self.center + half, np.asarray(np.linalg.cholesky(matrix)), rng)

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        """``(count, D)`` points, uniform on it."""
        parts: list[FloatArray] = []
        while sum(map(len, parts)) < count:
            points = self._in_ball(max(1000, 4 * count), rng)
            parts.append(points[_in_cube(points)])
        return np.concatenate(parts)[:count]

    def log_prob(self, unit: FloatArray) -> FloatArray:
        """Log density ``(N,)``; ``-inf`` outside."""
        return np.asarray(np.where(self.out(unit) <= 1.0, -self.log_volume, -np.inf))

    def out(self, unit: FloatArray) -> FloatArray:
        """How far out points ``(N, D)`` of the cube lie ``(N,)``: 0 in the center, 1 on the surface."""
        return np.asarray(np.linalg.norm((unit - self.center) @ self._inverse.T, axis=1))

    def _in_ball(self, count: int, rng: np.random.Generator) -> FloatArray:
        dim = len(self.center)
        z = rng.standard_normal((count, dim))
        z *= (rng.random(count) ** (1.0 / dim) / np.linalg.norm(z, axis=1))[:, None]
        return np.asarray(self.center + z @ self._axes.T)


def _in_cube(points: FloatArray) -> FloatArray:
    return np.asarray(((points >= 0.0) & (points <= 1.0)).all(axis=1))
