"""The linear density that networks start from, in one kind of coordinates, as some of the draws have it."""

from dataclasses import dataclass

import numpy as np

from ...core.arrays import FloatArray
from ..posterior.latent import LatentDensity, LatentMixture
from .coordinates import STRAIGHT, Coordinates, fitted_scale
from .first_guess import FirstGuess
from .sparse_regression import shrunk_factor
from .view import Seen, View

# Training targets nearer to a face of the cube than this are moved to it: hundreds of draws resolve no more.
_FACE = 1e-4
# A prediction nearer than this is read as lying there.
_GUESS_FACE = 0.01


@dataclass(frozen=True, eq=False)
class White:
    """Draws as a linear density sees them.

    Args:
        errors: ``(N, D)``, whitened.
        volume: ``(N,)``, what turns a log density of whitened errors into one on the cube.
    """

    errors: FloatArray
    volume: FloatArray

    @property
    def log_prob(self) -> FloatArray:
        """``(N,)`` under the linear density itself."""
        norm = 0.5 * self.errors.shape[1] * np.log(2.0 * np.pi)
        return np.asarray(self.volume - 0.5 * (self.errors**2).sum(axis=1) - norm)


@dataclass(frozen=True, eq=False)
class LinearDensity:
    """A Gaussian about the first guess, in one kind of coordinates.

    Args:
        first: the guess, in probit coordinates or on the cube.
        scale: ``(D,)`` of the coordinates about the guess; infinite for those about nothing.
        cholesky: ``(D, D)``, what the errors are whitened by.
        training: the draws it was made from, each by its error under a guess made without it.
    """

    first: FirstGuess
    scale: FloatArray
    cholesky: FloatArray
    training: White

    @classmethod
    def fit(cls, name: str, view: View, unit: FloatArray, weights: FloatArray) -> "LinearDensity":
        """In coordinates of a name, from the draws ``unit (N, D)`` that a view was made from."""
        unit, seen = np.clip(unit, _FACE, 1.0 - _FACE), view.training
        if name == "probit":
            at = Coordinates.probit(unit.shape[1])
            z = at.to_latent(unit)
            first = FirstGuess.fit(seen.columns, z, weights, _inner(at, seen.guess))
            errors, scale = first.residual, at.scale
        else:
            first = view.first
            guess = unit - first.residual
            scale = fitted_scale(guess, unit, weights)
            if name == "straight":
                scale = np.minimum(scale, STRAIGHT)
            at = Coordinates.about(guess, scale)
            z = errors = at.to_latent(unit)
        cholesky = shrunk_factor(errors, weights)
        return cls(first, scale, cholesky, _whitened(errors, at.log_slope(unit, z), cholesky))

    def at(self, seen: Seen) -> tuple[Coordinates, FloatArray]:
        """Coordinates, one a row, and the centres ``(B, D)`` of the errors in them."""
        if np.isinf(self.scale).all():
            probit = Coordinates.probit(len(self.scale))
            return probit, self.first.mean(seen.columns, _inner(probit, seen.guess))
        mean = self.first.mean(seen.columns, seen.guess)
        return Coordinates.about(mean, self.scale), np.zeros_like(mean)

    def one(self, seen: Seen) -> tuple[Coordinates, FloatArray]:
        """The same of a single row, ``(D,)``."""
        coordinates, center = self.at(seen)
        mean = coordinates.mean if coordinates.mean.ndim == 1 else coordinates.mean[0]
        return Coordinates(mean, coordinates.scale), center[0]

    def white(self, seen: Seen, unit: FloatArray) -> White:
        """Draws ``unit (B, D)`` that it was not made from."""
        unit = np.clip(unit, _FACE, 1.0 - _FACE)
        coordinates, center = self.at(seen)
        z = coordinates.to_latent(unit)
        return _whitened(z - center, coordinates.log_slope(unit, z), self.cholesky)

    def density(self, seen: Seen, widening: float = 1.0) -> LatentDensity:
        """At one measurement."""
        coordinates, center = self.one(seen)
        return LatentMixture(coordinates, np.ones(1), center[None], widening * self.cholesky[None])


def _whitened(errors: FloatArray, slope: FloatArray, cholesky: FloatArray) -> White:
    white = np.linalg.solve(cholesky, errors.T).T
    return White(np.asarray(white), slope.sum(axis=1) - np.log(np.diagonal(cholesky)).sum())


def _inner(probit: Coordinates, guess: FloatArray | None) -> FloatArray | None:
    """Predictions of the cube in probit coordinates; those on or beyond a face as a little inside."""
    return None if guess is None else probit.to_latent(np.clip(guess, _GUESS_FACE, 1.0 - _GUESS_FACE))
