"""Posterior estimators: from simulated draws to a posterior over parameters."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

import numpy as np

from .arrays import FloatArray

#: Draws behind those answers of a posterior that have no closed form.
DRAWS = 20_000


class Posterior(ABC):
    """A density on the unit cube of a parameter space. Points are vectors ``(N, D)`` in ``[0, 1]``.

    What is not abstract here is answered from :data:`DRAWS` samples of a fixed seed; a posterior that knows better
    puts its closed form in place.
    """

    #: What :meth:`save` writes as the entry ``format`` of its .npz file, by which the right class is found again.
    format: ClassVar[str] = ""

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
        """Write to a file without pickle: an .npz that names :attr:`format`."""

    @classmethod
    @abstractmethod
    def load(cls, path: Path) -> "Posterior": ...

    def _draws(self) -> FloatArray:
        return self.sample(DRAWS, np.random.default_rng(0))

    def mean(self) -> FloatArray:
        """``(D,)`` expectation on the unit cube."""
        return np.asarray(self._draws().mean(axis=0))

    def std(self) -> FloatArray:
        """``(D,)`` standard deviation of each parameter on the unit cube; the prior has 0.289."""
        return np.asarray(self._draws().std(axis=0))

    def quantiles(self, levels: FloatArray) -> FloatArray:
        """Quantiles ``(Q, D)`` of each parameter on the unit cube, at levels ``(Q,)`` between 0 and 1."""
        return np.asarray(np.quantile(self._draws(), levels, axis=0))

    def marginal(self, index: int, at: FloatArray) -> FloatArray:
        """Density ``(M,)`` of one parameter at places ``(M,)`` on the unit interval; zero outside.

        Here a kernel estimate, reflected at both ends so that no mass leaks outside the prior; a third of
        Silverman's width, which would smear two peaks into each other and is meant for fewer draws.
        """
        draws, at = self._draws()[:, index], np.asarray(at, float)
        middle = float(np.subtract(*np.percentile(draws, [75, 25]))) / 1.34
        width = max(0.3 * min(float(draws.std()), middle or np.inf) * len(draws) ** -0.2, 1e-4)
        count, edges = np.histogram(draws, bins=np.linspace(0.0, 1.0, 1 + min(4000, int(np.ceil(8 / width)))))
        centres = 0.5 * (edges[1:] + edges[:-1])
        density = np.zeros(at.shape)
        for mirrored in (centres, -centres, 2.0 - centres):
            density += np.exp(-0.5 * ((at[:, None] - mirrored) / width) ** 2) @ count
        density /= len(draws) * width * np.sqrt(2 * np.pi)
        return np.asarray(np.where((at >= 0.0) & (at <= 1.0), density, 0.0))

    def components(self) -> tuple[FloatArray, FloatArray] | None:
        """Weights ``(K,)`` and centres ``(K, D)`` in the unit cube where the posterior is a mixture, else None."""
        return None


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
