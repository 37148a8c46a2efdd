"""A posterior on the unit cube: Gaussian mixtures in probit coordinates, normalised exactly."""

from pathlib import Path
from typing import ClassVar

import numpy as np
from scipy.special import logsumexp, ndtr, ndtri

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ...core.estimator import Posterior
from .archive import open_archive, write_archive

# Below this distance from a face of the cube the probit is taken at this distance: |z| stays below 7.1.
_EDGE = 1e-12


def to_latent(unit: FloatArray, edge: float = _EDGE) -> FloatArray:
    """Unit cube to probit coordinates, ``z = Phi^-1(u)``; the uniform prior becomes N(0, I).

    Args:
        unit: ``(..., D)`` in ``[0, 1]``.
        edge: coordinates nearer than this to 0 or 1 are moved to it.
    """
    return np.asarray(ndtri(np.clip(unit, edge, 1.0 - edge)), float)


class MixturePosterior(Posterior):
    """``p(u) = sum_k w_k N(z; m_k, L_k L_k^T) / N(z; 0, I)`` with ``z = Phi^-1(u)``, u in the unit cube.

    The map is a bijection from the open cube to R^D, so the density integrates to one over the cube and no mass
    can lie outside the prior's bounds. The probit is used rather than the logit because the uniform prior is then
    itself one Gaussian: a parameter that the data say nothing about gets an exactly flat marginal.

    Args:
        weights: ``(K,)``, not negative; scaled to sum to one.
        means: ``(K, D)`` in probit coordinates.
        cholesky: ``(K, D, D)`` lower-triangular, positive diagonal.

    Raises:
        InputError: shapes that do not fit, or values that make no density.
    """

    format: ClassVar[str] = "muslin-mixture-posterior-1"

    def __init__(self, weights: FloatArray, means: FloatArray, cholesky: FloatArray) -> None:
        weights, means, cholesky = (np.array(a, float) for a in (weights, means, cholesky))
        if means.ndim != 2 or weights.shape != means.shape[:1] or cholesky.shape != (*means.shape, means.shape[1]):
            raise InputError(
                "a mixture needs weights (K,), means (K, D) and cholesky (K, D, D), "
                f"but got {weights.shape}, {means.shape}, {cholesky.shape}"
            )
        if not all(np.isfinite(a).all() for a in (weights, means, cholesky)):
            raise InputError("a mixture holds a value that is not a finite number")
        if (weights < 0).any() or weights.sum() <= 0 or (np.diagonal(cholesky, axis1=1, axis2=2) <= 0).any():
            raise InputError("mixture weights must not be negative and Cholesky diagonals must be above zero")
        # A sum within rounding of one is kept as it is, so that a saved posterior comes back bit for bit.
        total = weights.sum()
        self.weights = weights if abs(total - 1.0) < 1e-12 else weights / total
        self.means = means
        self.cholesky = np.tril(cholesky)

    @property
    def dim(self) -> int:
        """D, the number of parameters."""
        return int(self.means.shape[1])

    @classmethod
    def average(cls, members: "list[MixturePosterior]") -> "MixturePosterior":
        """The posterior whose density is the mean of the members' densities."""
        return cls(
            np.concatenate([m.weights for m in members]) / len(members),
            np.concatenate([m.means for m in members]),
            np.concatenate([m.cholesky for m in members]),
        )

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        which = rng.choice(len(self.weights), size=count, p=self.weights / self.weights.sum())
        noise = rng.standard_normal((count, self.dim))
        z = self.means[which] + np.einsum("nij,nj->ni", self.cholesky[which], noise)
        # Phi rounds to 0 or 1 far out; the nearest numbers inside keep every draw in the open cube.
        unit = np.clip(ndtr(z), np.finfo(float).tiny, 1.0 - np.finfo(float).epsneg)
        return np.asarray(unit, float)

    def log_prob(self, unit: FloatArray) -> FloatArray:
        u = np.asarray(unit, float)
        if u.ndim != 2 or u.shape[1] != self.dim:
            raise InputError(f"log_prob needs points of shape (N, {self.dim}), but got {u.shape}")
        z = to_latent(u)
        log_p = np.full((len(self.weights), len(u)), -np.inf)
        for k in np.flatnonzero(self.weights > 0):
            white = np.linalg.solve(self.cholesky[k], (z - self.means[k]).T)
            log_det = np.log(np.diagonal(self.cholesky[k])).sum()
            log_p[k] = np.log(self.weights[k]) - 0.5 * (white**2).sum(axis=0) - log_det
        # The factor (2 pi)^(-D/2) cancels against that of N(z; 0, I), the Jacobian of the map.
        density = np.asarray(logsumexp(log_p, axis=0), float) + 0.5 * (z**2).sum(axis=1)
        inside = ((u >= 0.0) & (u <= 1.0)).all(axis=1)
        return np.asarray(np.where(inside, density, -np.inf))

    def mean(self) -> FloatArray:
        """``(D,)`` expectation on the unit cube, exact: ``E[Phi(z)] = Phi(m / sqrt(1 + s^2))`` per component."""
        variance = (self.cholesky**2).sum(axis=2)
        return np.asarray(self.weights @ ndtr(self.means / np.sqrt(1.0 + variance)), float)

    def std(self) -> FloatArray:
        """``(D,)`` standard deviation of each parameter on the unit cube, by Gauss-Hermite quadrature."""
        nodes, mass = np.polynomial.hermite_e.hermegauss(64)
        mass = mass / mass.sum()
        scale = np.sqrt((self.cholesky**2).sum(axis=2))
        values = ndtr(self.means[..., None] + scale[..., None] * nodes)
        first, second = self.weights @ (values @ mass), self.weights @ (values**2 @ mass)
        return np.asarray(np.sqrt(np.maximum(second - first**2, 0.0)), float)

    def quantiles(self, levels: FloatArray) -> FloatArray:
        """Quantiles ``(Q, D)`` on the unit cube, at levels ``(Q,)``: of a mixture of normals, by bisection."""
        levels, scale = np.asarray(levels, float), np.sqrt((self.cholesky**2).sum(axis=2))
        low, high = np.full((len(levels), self.dim), -40.0), np.full((len(levels), self.dim), 40.0)
        for _ in range(60):
            middle = 0.5 * (low + high)
            below = np.einsum("k,qkd->qd", self.weights, ndtr((middle[:, None] - self.means) / scale))
            low, high = (
                np.where(below < levels[:, None], middle, low),
                np.where(below < levels[:, None], high, middle),
            )
        return np.asarray(ndtr(0.5 * (low + high)), float)

    def marginal(self, index: int, at: FloatArray) -> FloatArray:
        """Density ``(M,)`` of one parameter at places ``(M,)`` on the unit interval, exact; zero outside."""
        keep = [index]
        covariance = (self.cholesky[:, keep] ** 2).sum(axis=2)
        one = MixturePosterior(self.weights, self.means[:, keep], np.sqrt(covariance)[:, :, None])
        return np.asarray(np.exp(one.log_prob(np.asarray(at, float)[:, None])))

    def components(self) -> tuple[FloatArray, FloatArray]:
        """Weights ``(K,)`` and the centres ``(K, D)`` of the components, mapped to the unit cube."""
        return self.weights.copy(), np.asarray(ndtr(self.means), float)

    def save(self, path: Path) -> None:
        write_archive(path, self.format, weights=self.weights, means=self.means, cholesky=self.cholesky)

    @classmethod
    def load(cls, path: Path) -> "MixturePosterior":
        with open_archive(path, cls.format) as data:
            return cls(data["weights"], data["means"], data["cholesky"])
