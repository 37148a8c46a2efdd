"""Posteriors that are known: parameters standard normal in probit coordinates, seen through Gaussian noise."""

from pathlib import Path

import numpy as np
from scipy.special import ndtr

from muslin.core.arrays import FloatArray
from muslin.core.estimator import Posterior
from muslin.inference.posterior.mixture import MixturePosterior

#: Noise of the observation, in prior standard deviations.
NOISE = 0.5
#: Exact standard deviation of the posterior, in probit coordinates.
SD = (1 + NOISE**-2) ** -0.5


def exact(
    latent: FloatArray, rng: np.random.Generator, width: float = 1.0, shift: float = 0.0, correlation: float = 0.0
) -> list[tuple[Posterior, FloatArray]]:
    """Posteriors given one simulation of each row ``(N, D)``, and that row in the unit cube; on purpose wrong.

    Args:
        latent: parameters in probit coordinates.
        rng: of the noise.
        width: factor on all standard deviations.
        shift: of the first parameter, in posterior standard deviations.
        correlation: claimed between the first two parameters, where there is none.
    """
    seen = latent + NOISE * rng.standard_normal(latent.shape)
    dim = latent.shape[1]
    claimed = np.eye(dim)
    claimed[0, 1] = claimed[1, 0] = correlation
    factor = width * SD * np.linalg.cholesky(claimed)
    push = shift * SD * np.eye(dim)[0]
    return [
        (MixturePosterior(np.ones(1), (SD**2 / NOISE**2 * x + push)[None], factor[None]), ndtr(z))
        for x, z in zip(seen, latent, strict=True)
    ]


class Crescents(Posterior):
    """Two arcs that face each other, without closed form for anything but the density; also not normalised."""

    @property
    def dim(self) -> int:
        return 2

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        angle, radius = rng.uniform(-1.4, 1.4, count), 0.25 + 0.01 * rng.standard_normal(count)
        side = np.where(rng.random(count) < 0.7, 1.0, -1.0)
        return np.stack([0.5 + side * (0.15 + radius * np.cos(angle)), 0.5 + radius * np.sin(angle)], axis=1)

    def log_prob(self, unit: FloatArray) -> FloatArray:
        sides = []
        for side, weight in ((1.0, 0.7), (-1.0, 0.3)):
            x, y = side * (unit[:, 0] - 0.5) - 0.15, unit[:, 1] - 0.5
            radius, inside = np.hypot(x, y), np.abs(np.arctan2(y, x)) < 1.4
            with np.errstate(divide="ignore"):
                height = np.log(weight) - 0.5 * ((radius - 0.25) / 0.01) ** 2 - np.log(radius)
            sides.append(np.where(inside, height, -np.inf))
        return np.asarray(np.logaddexp(*sides))

    def save(self, path: Path) -> None:
        raise NotImplementedError

    @classmethod
    def load(cls, path: Path) -> "Crescents":
        raise NotImplementedError
