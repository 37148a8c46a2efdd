"""Posteriors and estimators that break one promise of the kit each."""

import random
import time
from pathlib import Path
from typing import Any

import numpy as np
from right_estimator import SIZE, GridPosterior, Right

from muslin.core.arrays import FloatArray
from muslin.core.errors import InputError
from muslin.core.estimator import Posterior

# Posteriors that are wrong


class Leaking(GridPosterior):
    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        return super().sample(count, rng) + 0.6


class Boundless(GridPosterior):
    def log_prob(self, unit: FloatArray) -> FloatArray:
        return super().log_prob(np.clip(unit, 0, 1))


class Unnormalised(GridPosterior):
    def log_prob(self, unit: FloatArray) -> FloatArray:
        return super().log_prob(unit) + 0.1


class Tempered(GridPosterior):
    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        return GridPosterior(self.mass**2).sample(count, rng)


class Elsewhere(GridPosterior):
    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        return np.clip(super().sample(count, rng) + 0.03, 0, 1)


class Repeating(GridPosterior):
    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        return np.resize(super().sample(2000, rng), (count, 2))


class Slow(GridPosterior):
    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        until = time.process_time() + 1.05e-4 * count
        while time.process_time() < until:
            pass
        return super().sample(count, rng)


class Forgetful(GridPosterior):
    @classmethod
    def load(cls, path: Path) -> "GridPosterior":
        return GridPosterior(np.float32(np.load(path)["mass"]).astype(float))


class Pickled(GridPosterior):
    def save(self, path: Path) -> None:
        with path.open("wb") as file:
            np.savez(file, mass=np.array([self.mass, None], dtype=object))


class Renamed(GridPosterior):
    def save(self, path: Path) -> None:
        super().save(path.with_suffix(".posterior"))


class Clipped(GridPosterior):
    """Mass within a twentieth of a bound ends up on it."""

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        return np.clip(1.1 * super().sample(count, rng) - 0.05, 0, 1)


class Uncut(GridPosterior):
    """Forgets that a normal loses mass where the bounds cut it."""

    def log_prob(self, unit: FloatArray) -> FloatArray:
        edge = self.mass[[0, -1]].sum() + self.mass[:, [0, -1]].sum()
        return super().log_prob(unit) + np.log1p(-min(0.5, 5.0 * edge))


# Estimators that are wrong


class Wrong(Right):
    """With the posterior of :attr:`kind`."""

    @classmethod
    def of(cls, kind: type[GridPosterior]) -> type[Right]:
        return type(kind.__name__, (cls,), {"kind": kind})


class Unseeded(Right):
    def mass(self, precision: FloatArray, pull: FloatArray) -> FloatArray:
        return super().mass(precision, pull) + np.random.default_rng().random() * 1e-9


class Warm(Right):
    """Starts where the last fit ended."""

    def fit(self, theta: FloatArray, x: list[FloatArray], **options: Any) -> None:
        before = self.slope
        super().fit(theta, x, **options)
        if before is not None and self.slope is not None:
            self.slope = self.slope + 1e-6 * before


class GlobalNumpy(Right):
    def posterior(self, x: list[FloatArray]) -> Posterior:
        np.random.rand(1)  # noqa: NPY002
        return super().posterior(x)


class GlobalPython(Right):
    def fit(self, theta: FloatArray, x: list[FloatArray], **options: Any) -> None:
        random.seed(0)
        super().fit(theta, x, **options)


class WritesDraws(Right):
    def fit(self, theta: FloatArray, x: list[FloatArray], **options: Any) -> None:
        theta *= 0.999
        super().fit(theta, x, **options)


class WritesMeasurement(Right):
    def posterior(self, x: list[FloatArray]) -> Posterior:
        x[0][x[0] < 0.1] = 0.1
        return super().posterior(x)


class Eager(Right):
    def posterior(self, x: list[FloatArray]) -> Posterior:
        return GridPosterior(np.ones((SIZE, SIZE))) if self.slope is None else super().posterior(x)


class Absent(Right):
    def posterior(self, x: list[FloatArray]) -> Posterior:
        self.slope[0]  # type: ignore[index]
        return super().posterior(x)


class Careless(Right):
    def fit(self, theta: FloatArray, x: list[FloatArray], **options: Any) -> None:
        pad = np.concatenate([np.zeros((10, 2)), theta])
        super().fit(pad, [np.nan_to_num(np.concatenate([np.zeros((10, *a.shape[1:])), a])) for a in x], **options)


class Strict(Right):
    def fit(self, theta: FloatArray, x: list[FloatArray], **options: Any) -> None:
        if len(theta) < 10 or np.isnan(x[0]).all(axis=(1, 2, 3)).any():
            raise RuntimeError("the matrix is singular")
        super().fit(theta, x, **options)


class Certain(Right):
    """Never as wide as the prior."""

    def mass(self, precision: FloatArray, pull: FloatArray) -> FloatArray:
        return super().mass(precision + 100.0 * np.eye(2), pull + 50.0)


class Brittle(Right):
    """NaN in, NaN out."""

    def posterior(self, x: list[FloatArray]) -> Posterior:
        posterior = super().posterior(x)
        assert isinstance(posterior, GridPosterior)
        posterior.mass = posterior.mass + 0.0 * (1.0 if np.isfinite(x[0]).all() else np.nan)
        return posterior


class OneRecording(Right):
    def features(self, x: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
        return super().features(x[:1])


class AnyRecordings(Right):
    """Takes a recording that is not there for one in which nothing was seen."""

    def fit(self, theta: FloatArray, x: list[FloatArray], **options: Any) -> None:
        super().fit(theta, x, **options)
        self.empty = [np.full(a.shape[1:], np.nan) for a in x]

    def posterior(self, x: list[FloatArray]) -> Posterior:
        return super().posterior([*x, *self.empty[len(x) :]])


class Ordered(Right):
    """Asked for sets, it still tells points apart by their place."""

    def __init__(self, *, correspondence: bool = True) -> None:
        super().__init__(correspondence=True)


class OrderedTraining(Right):
    """Reads the first points in training and all of them afterwards."""

    def fit(self, theta: FloatArray, x: list[FloatArray], **options: Any) -> None:
        super().fit(theta, [a[:, :, :3] for a in x] if len(x) == 1 else x, **options)


class FixedSize(Right):
    def fit(self, theta: FloatArray, x: list[FloatArray], **options: Any) -> None:
        super().fit(theta, x, **options)
        self.points = x[0].shape[2]

    def posterior(self, x: list[FloatArray]) -> Posterior:
        if x[0].shape[1] != self.points:
            raise InputError("another number of points")
        return super().posterior(x)


class Weightless(Right):
    """Takes where the draws lie for the prior."""

    def mass(self, precision: FloatArray, pull: FloatArray) -> FloatArray:
        sd = np.maximum(self.theta.std(axis=0), 0.1)
        return super().mass(precision + np.diag(sd**-2), pull + self.theta.mean(axis=0) / sd**2)


class Shy(Right):
    """Keeps away from the bounds."""

    def mass(self, precision: FloatArray, pull: FloatArray) -> FloatArray:
        inner = np.zeros((SIZE, SIZE))
        inner[30:-30, 30:-30] = 1.0
        return super().mass(precision, pull) * inner + 1e-12


class Shifted(Right):
    def mass(self, precision: FloatArray, pull: FloatArray) -> FloatArray:
        return super().mass(precision, pull + precision @ np.array([0.06, 0.06]))


class Overconfident(Right):
    widening = 0.4


class Sizeless(Right):
    """Ten points, whatever their number."""

    def features(self, x: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
        values, counts = super().features(x)
        return values, np.where(counts > 0, 10.0, 0.0)
