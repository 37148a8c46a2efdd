"""A posterior on the unit cube mixed of flows and Gaussian mixtures, each in coordinates of its own."""

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from scipy.special import logsumexp

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ...core.estimator import Posterior
from .archive import open_archive, write_archive
from .latent import LatentDensity, latent_density


class FlowPosterior(Posterior):
    """``p(u) = sum_m w_m q_m(z_m(u)) |dz_m/du|``: exact support and normalisation, as every z_m is one-to-one.

    Args:
        weights: ``(M,)``, not negative; scaled to add up to one.
        parts: M densities on R^D.

    Raises:
        InputError: none of them, weights that do not fit, or parts of different dimension.
    """

    format: ClassVar[str] = "muslin-flow-posterior-1"

    def __init__(self, weights: FloatArray, parts: list[LatentDensity]) -> None:
        weights = np.array(weights, float)
        if not parts or weights.shape != (len(parts),) or len({p.dim for p in parts}) != 1:
            raise InputError("a posterior needs one or more densities of one dimension, and a weight for each")
        if not np.isfinite(weights).all() or (weights < 0).any() or weights.sum() <= 0:
            raise InputError("the weights of a posterior's parts must not be negative, and not all zero")
        total = weights.sum()
        self.weights = weights if abs(total - 1.0) < 1e-12 else weights / total
        self.parts = parts

    @property
    def dim(self) -> int:
        """D, the number of parameters."""
        return self.parts[0].dim

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        shares = rng.multinomial(count, self.weights)
        drawn = [
            part.coordinates.to_unit(part.sample(int(share), rng))
            for part, share in zip(self.parts, shares, strict=True)
            if share
        ]
        return np.asarray(rng.permutation(np.concatenate([np.zeros((0, self.dim)), *drawn])))

    def log_prob(self, unit: FloatArray) -> FloatArray:
        u = np.asarray(unit, float)
        if u.ndim != 2 or u.shape[1] != self.dim:
            raise InputError(f"log_prob needs points of shape (N, {self.dim}), but got {u.shape}")
        inside = np.asarray(((u >= 0.0) & (u <= 1.0)).all(axis=1))
        each = np.full((len(self.parts), len(u)), -np.inf)
        within, known = np.where(inside[:, None], u, 0.5), {}
        for m, part in enumerate(self.parts):
            if self.weights[m] > 0:
                at = part.coordinates
                if at.key not in known:
                    z = at.to_latent(within)
                    known[at.key] = z, at.log_slope(within, z).sum(axis=1)
                z, slope = known[at.key]
                each[m] = np.log(self.weights[m]) + part.log_prob(z) + slope
        return np.asarray(np.where(inside, logsumexp(each, axis=0), -np.inf))

    def save(self, path: Path) -> None:
        arrays: dict[str, Any] = {}
        for m, part in enumerate(self.parts):
            arrays |= {f"part_{m}/{k}": v for k, v in part.arrays().items()}
        write_archive(path, self.format, part_weights=self.weights, **arrays)

    @classmethod
    def load(cls, path: Path) -> "FlowPosterior":
        with open_archive(path, cls.format) as data:
            parts = []
            for m in range(len(data["part_weights"])):
                start = f"part_{m}/"
                arrays = {k.removeprefix(start): data[k] for k in data.files if k.startswith(start)}
                parts.append(latent_density(arrays))
            return cls(data["part_weights"], parts)
