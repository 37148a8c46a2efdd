"""Posterior estimators: from simulated draws to a posterior over parameters."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

import numpy as np

from .arrays import FloatArray


class Posterior(ABC):
    """A density on the unit cube of a parameter space. Points are vectors ``(N, D)`` in ``[0, 1]``."""

    @property
    @abstractmethod
    def dim(self) -> int:
        """D, the number of parameters."""

    @abstractmethod
    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        """``(count, D)`` draws, all inside the unit cube."""

    @abstractmethod
    def log_prob(self, unit: FloatArray) -> FloatArray:
        """Natural log density ``(N,)`` on the unit cube; ``-inf`` outside; integrates to one."""

    @abstractmethod
    def save(self, path: Path) -> None:
        """Write to a file without pickle."""

    @classmethod
    @abstractmethod
    def load(cls, path: Path) -> "Posterior": ...


class PosteriorEstimator(ABC):
    """A conditional density q(theta | x), trained on simulated draws.

    Subclasses take their options as keyword arguments with defaults; all randomness comes from
    ``seed``, so the same draws and the same seed give the same posterior.
    """

    name: ClassVar[str]

    @abstractmethod
    def fit(
        self,
        theta: FloatArray,
        x: list[FloatArray],
        *,
        log_weights: FloatArray | None = None,
        seed: int = 0,
    ) -> None:
        """Train, replacing whatever was trained before.

        Args:
            theta: ``(N, D)`` in the unit cube.
            x: one array a recording, ``(N, T_r, P, A)``: point series of every draw; NaN = not seen.
            log_weights: ``(N,)``, log p(theta)/p~(theta) of prior over proposal; None when all draws
                come from the prior.
        """

    @abstractmethod
    def posterior(self, x: list[FloatArray]) -> Posterior:
        """The posterior given one measurement: ``(T_r, P, A)`` a recording, in the order of :meth:`fit`."""
