"""An estimator in numpy that keeps every promise of the kit."""

from pathlib import Path

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.errors import InputError, StepMissingError
from muslin.core.estimator import Posterior, PosteriorEstimator

SIZE = 200


class GridPosterior(Posterior):
    """A density that is constant on the cells of a grid on the unit square: all answers exact."""

    dim = 2

    def __init__(self, mass: FloatArray) -> None:
        self.mass = mass / mass.sum()

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        cells = rng.choice(self.mass.size, size=count, p=self.mass.ravel())
        corner = np.stack(np.unravel_index(cells, self.mass.shape), axis=1)
        return np.asarray((corner + rng.random((count, 2))) / SIZE)

    def log_prob(self, unit: FloatArray) -> FloatArray:
        cell = np.clip((unit * SIZE).astype(int), 0, SIZE - 1)
        inside = ((unit >= 0) & (unit <= 1)).all(axis=1)
        return np.where(inside, np.log(self.mass[cell[:, 0], cell[:, 1]] * SIZE**2), -np.inf)

    def save(self, path: Path) -> None:
        with path.open("wb") as file:
            np.savez(file, mass=self.mass)

    @classmethod
    def load(cls, path: Path) -> "GridPosterior":
        with np.load(path) as data:
            posterior = cls.__new__(cls)
            posterior.mass = data["mass"]
            return posterior


class Right(PosteriorEstimator):
    """Every coordinate as a linear function of the parameters under noise, by least squares; Bayes on a grid.

    Without correspondence the coordinates are the means of the points of each frame, whose noise goes with one over
    the root of their number. As the likelihood is learned, it needs no weights.
    """

    name = "right"
    kind: type[GridPosterior] = GridPosterior
    widening = 1.0

    def __init__(self, *, correspondence: bool = True) -> None:
        self.correspondence = correspondence
        self.slope: FloatArray | None = None

    def features(self, x: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
        """``(N, F)`` coordinates, NaN = not seen, and how many points are behind each."""
        if self.correspondence:
            flat = np.concatenate([a.reshape(len(a), -1) for a in x], axis=1)
            return flat, np.ones(flat.shape)
        count = [np.isfinite(a).sum(axis=2) for a in x]
        with np.errstate(invalid="ignore"):
            mean = [np.nansum(a, axis=2) / c for a, c in zip(x, count, strict=True)]
        return tuple(np.concatenate([b.reshape(len(b), -1) for b in p], axis=1) for p in (mean, count))  # type: ignore[return-value]

    def fit(
        self, theta: FloatArray, x: list[FloatArray], *, log_weights: FloatArray | None = None, seed: int = 0
    ) -> None:
        if len(theta) < 10 or any(np.isnan(a).all(axis=(1, 2, 3)).any() for a in x):
            raise InputError("too few draws, or failed ones")
        self.recordings, self.theta = len(x), theta
        values, counts = self.features(x)
        design = np.column_stack([np.ones(len(theta)), theta])
        self.start, self.slope, self.noise = np.empty(values.shape[1]), np.zeros((values.shape[1], 2)), []
        for f, (y, n) in enumerate(zip(values.T, counts.T, strict=True)):
            seen, root = np.isfinite(y), np.sqrt(n)
            fitted = np.linalg.lstsq((design * root[:, None])[seen], (y * root)[seen], rcond=None)[0]
            self.start[f], self.slope[f] = fitted[0], fitted[1:]
            left = (y - design @ fitted)[seen] * root[seen]
            self.noise.append(max(left.std(), 1e-6 * np.abs(fitted).max(), 1e-9))
        constant = np.abs(self.slope).max(axis=1) < 1e-9
        self.slope[constant] = 0.0

    def posterior(self, x: list[FloatArray]) -> Posterior:
        if self.slope is None:
            raise StepMissingError("right has no posterior before fit")
        if len(x) != self.recordings:
            raise InputError("as many recordings as in training")
        values, counts = (v[0] for v in self.features([a[None] for a in x]))
        seen = np.isfinite(values)
        precision = counts[seen] / np.square(self.noise)[seen] / self.widening**2
        slope, value = self.slope[seen], (values - self.start)[seen]
        return self.kind(self.mass(slope.T @ (precision[:, None] * slope), slope.T @ (precision * value)))

    def mass(self, precision: FloatArray, pull: FloatArray) -> FloatArray:
        """Of the cells, for a density ``exp(pull . u - u . precision u / 2)``."""
        axis = (np.arange(SIZE) + 0.5) / SIZE
        grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
        log_p = grid @ pull - 0.5 * np.einsum("abi,ij,abj->ab", grid, precision, grid)
        return np.asarray(np.exp(log_p - log_p.max()) + 1e-12)
