"""Posteriors of whatever kind, mixed with fixed weights."""

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
from scipy.special import logsumexp

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ...core.estimator import Posterior
from .archive import open_archive, parts_as_arrays, parts_in, write_archive


class StackedPosterior(Posterior):
    """``p(u) = sum_k w_k p_k(u)``.

    Args:
        weights: ``(K,)``, not negative; scaled to add up to one.
        parts: K posteriors of the same parameters.

    Raises:
        InputError: none of them, weights that do not fit, or parts of different dimension.
    """

    format: ClassVar[str] = "muslin-stacked-posterior-1"

    def __init__(self, weights: FloatArray, parts: Sequence[Posterior]) -> None:
        weights = np.array(weights, float)
        if not parts or weights.shape != (len(parts),) or len({p.dim for p in parts}) != 1:
            raise InputError("a mixture of posteriors needs one or more of one dimension, and a weight for each")
        if not np.isfinite(weights).all() or (weights < 0).any() or weights.sum() <= 0:
            raise InputError("the weights of posteriors must not be negative, and not all zero")
        total = weights.sum()
        # A sum within rounding of one is kept as it is, so that a saved posterior comes back bit for bit.
        self.weights = weights if abs(total - 1.0) < 1e-12 else weights / total
        self.parts = list(parts)

    @property
    def dim(self) -> int:
        """D, the number of parameters."""
        return self.parts[0].dim

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        shares = rng.multinomial(count, self.weights)
        drawn = [p.sample(int(n), rng) for p, n in zip(self.parts, shares, strict=True) if n]
        return np.asarray(rng.permutation(np.concatenate([np.zeros((0, self.dim)), *drawn])))

    def log_prob(self, unit: FloatArray) -> FloatArray:
        each = [np.log(w) + p.log_prob(unit) for p, w in zip(self.parts, self.weights, strict=True) if w > 0]
        return np.asarray(logsumexp(each, axis=0))

    def save(self, path: Path) -> None:
        write_archive(path, self.format, part_weights=self.weights, **parts_as_arrays(self.parts))

    @classmethod
    def load(cls, path: Path) -> "StackedPosterior":
        with open_archive(path, cls.format) as data:
            return cls(data["part_weights"], parts_in(data))
