"""The linear density that networks start from, in one kind of coordinates, as some of the draws have it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core.arrays import FloatArray
from ..posterior.latent import LatentMixture
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
        errors: ``(..., D)``, whitened; what networks learn.
        volume: ``(...)``, what turns a log density of whitened errors into one on the cube.
    """

    errors: FloatArray
    volume: FloatArray

    @property
    def log_prob(self) -> FloatArray:
        """``(...)`` under the linear density itself."""
        norm = 0.5 * self.errors.shape[-1] * np.log(2.0 * np.pi)
        return np.asarray(self.volume - 0.5 * (self.errors**2).sum(axis=-1) - norm)


@dataclass(frozen=True, eq=False)
class LinearDensity:
    """A Gaussian about the first guess, in one kind of coordinates.

    Args:
        at: what is read of ``(B,)`` draws to coordinates, their mean one for all or ``(B, D)``, and the centres
            ``(B, D)`` of the errors in them.
        scale: ``(D,)`` of the coordinates.
        cholesky: ``(D, D)``, what the errors are whitened by.
        training: the draws it was made from, each by its error under a guess made without it.
    """

    at: Callable[[Seen], tuple[Coordinates, FloatArray]]
    scale: FloatArray
    cholesky: FloatArray
    training: White

    @classmethod
    def fit(cls, name: str, view: View, unit: FloatArray, weights: FloatArray) -> "LinearDensity":
        """In coordinates of a name, from the draws ``unit (N, D)`` that a view was made from."""
        seen, inner = view.training, np.clip(unit, _FACE, 1.0 - _FACE)
        if name == "probit":
            about = Coordinates.probit(unit.shape[1])
            z, scale = about.to_latent(inner), about.scale
            first = FirstGuess.fit(seen.columns, z, weights, _inner(about, seen.guess))
            errors = first.residual

            def at(s: Seen) -> tuple[Coordinates, FloatArray]:
                return about, first.mean(s.columns, _inner(about, s.guess))
        else:
            guess = unit - view.first.residual
            scale = fitted_scale(guess, inner, weights)
            if name == "straight":
                scale = np.minimum(scale, STRAIGHT)
            about = Coordinates.about(guess, scale)
            z = errors = about.to_latent(inner)

            def at(s: Seen) -> tuple[Coordinates, FloatArray]:
                mean = view.first.mean(s.columns, s.guess)
                return Coordinates.about(mean, scale), np.zeros_like(mean)

        cholesky = shrunk_factor(errors, weights)
        return cls(at, scale, cholesky, _whitened(errors, about.log_slope(inner, z), cholesky))

    def one(self, seen: Seen) -> tuple[Coordinates, FloatArray]:
        """Coordinates and centre ``(D,)`` at one measurement."""
        coordinates, center = self.at(seen)
        return Coordinates(np.atleast_2d(coordinates.mean)[0], coordinates.scale), center[0]

    def white(self, seen: Seen, unit: FloatArray) -> White:
        """Draws ``unit (B, D)`` that it was not made from."""
        inner = np.clip(unit, _FACE, 1.0 - _FACE)
        coordinates, center = self.at(seen)
        z = coordinates.to_latent(inner)
        return _whitened(z - center, coordinates.log_slope(inner, z), self.cholesky)

    def mixture(self, seen: Seen, weights: FloatArray, means: FloatArray, factors: FloatArray) -> LatentMixture:
        """At one measurement, Gaussians ``(K,)``, ``(K, D)``, ``(K, D, D)`` of the whitened errors as a density."""
        coordinates, center = self.one(seen)
        return LatentMixture(coordinates, weights, center + means @ self.cholesky.T, self.cholesky @ factors)

    def density(self, seen: Seen) -> LatentMixture:
        """The linear density itself at one measurement."""
        dim = len(self.scale)
        return self.mixture(seen, np.ones(1), np.zeros((1, dim)), np.eye(dim)[None])


def _whitened(errors: FloatArray, slope: FloatArray, cholesky: FloatArray) -> White:
    white = np.linalg.solve(cholesky, errors.T).T
    return White(np.asarray(white), slope.sum(axis=1) - np.log(np.diagonal(cholesky)).sum())


def _inner(probit: Coordinates, guess: FloatArray | None) -> FloatArray | None:
    """Predictions of the cube in probit coordinates; those on or beyond a face as a little inside."""
    return None if guess is None else probit.to_latent(np.clip(guess, _GUESS_FACE, 1.0 - _GUESS_FACE))
