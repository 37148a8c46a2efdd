"""Densities on R^D at one measurement, of which a posterior on the unit cube is mixed."""

import json
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import torch
from scipy.special import logsumexp
from torch import Tensor

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ..density.coordinates import Coordinates
from ..density.flow import FlowNetwork, FlowShape
from ..density.training import isolated

# Points whose density is found at a time.
_CHUNK = 20_000
# One answers the same to the bit wherever it is asked, and does not wait for another that is busy elsewhere.
_THREADS = 1


class LatentDensity(ABC):
    """A normalised density on R^D, in coordinates of its own."""

    coordinates: Coordinates

    @property
    @abstractmethod
    def dim(self) -> int:
        """D."""

    @abstractmethod
    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        """``(count, D)``."""

    @abstractmethod
    def log_prob(self, z: FloatArray) -> FloatArray:
        """``(N,)`` natural log density of ``(N, D)``."""

    @abstractmethod
    def arrays(self) -> dict[str, Any]:
        """What it takes to build it again: arrays and text by name."""


class LatentMixture(LatentDensity):
    """Gaussians ``sum_k w_k N(m_k, L_k L_k^T)``.

    Args:
        coordinates: mean and scale ``(D,)`` each.
        weights: ``(K,)`` adding up to one; means: ``(K, D)``; cholesky: ``(K, D, D)``.
    """

    def __init__(self, coordinates: Coordinates, weights: FloatArray, means: FloatArray, cholesky: FloatArray) -> None:
        self.coordinates = coordinates
        self.weights, self.means, self.cholesky = (np.array(a, float) for a in (weights, means, cholesky))
        if not all(np.isfinite(a).all() for a in (self.weights, self.means, self.cholesky)):
            raise InputError("a mixture holds a value that is not a finite number")

    @property
    def dim(self) -> int:
        return int(self.means.shape[1])

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        which = rng.choice(len(self.weights), size=count, p=self.weights / self.weights.sum())
        noise = rng.standard_normal((count, self.dim))
        return np.asarray(self.means[which] + np.einsum("nij,nj->ni", self.cholesky[which], noise))

    def log_prob(self, z: FloatArray) -> FloatArray:
        each = np.full((len(self.weights), len(z)), -np.inf)
        for k in np.flatnonzero(self.weights > 0):
            white = np.linalg.solve(self.cholesky[k], (z - self.means[k]).T)
            norm = np.log(np.diagonal(self.cholesky[k])).sum() + 0.5 * self.dim * np.log(2.0 * np.pi)
            each[k] = np.log(self.weights[k]) - 0.5 * (white**2).sum(axis=0) - norm
        return np.asarray(logsumexp(each, axis=0))

    def arrays(self) -> dict[str, Any]:
        return {
            "kind": "mixture",
            "coordinates": np.stack([self.coordinates.mean, self.coordinates.scale]),
            "weights": self.weights,
            "means": self.means,
            "cholesky": self.cholesky,
        }


class LatentFlow(LatentDensity):
    """A conditional flow at one context: ``z = center + L r`` with r drawn from the flow, in float32.

    Args:
        coordinates: mean and scale ``(D,)`` each.
        context: ``(F,)`` features of the measurement.
        center: ``(D,)``; cholesky: ``(D, D)`` lower triangular.
        network: the flow, float32; it is not changed.
    """

    def __init__(
        self,
        coordinates: Coordinates,
        context: FloatArray,
        center: FloatArray,
        cholesky: FloatArray,
        network: FlowNetwork,
    ) -> None:
        self.coordinates, self.network = coordinates, network
        self.context, self.center, self.cholesky = (np.array(a, float) for a in (context, center, cholesky))
        self._at = torch.tensor(self.context, dtype=torch.float32)

    @property
    def dim(self) -> int:
        return len(self.center)

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        noise = torch.tensor(rng.standard_normal((count, self.dim)), dtype=torch.float32)
        with isolated(0, _THREADS), torch.no_grad():
            white: Tensor = self.network.push(self._at.expand(count, -1), noise)
        return np.asarray(self.center + white.double().numpy() @ self.cholesky.T)

    def log_prob(self, z: FloatArray) -> FloatArray:
        white = torch.tensor(np.linalg.solve(self.cholesky, (z - self.center).T).T, dtype=torch.float32)
        with isolated(0, _THREADS), torch.no_grad():
            parts = [self.network.log_prob([self._at.expand(len(w), -1)], w) for w in torch.split(white, _CHUNK)]
        log_p = torch.cat(parts).double().numpy() if parts else np.zeros(0)
        return np.asarray(log_p - np.log(np.diagonal(self.cholesky)).sum())

    def arrays(self) -> dict[str, Any]:
        return {
            "kind": "flow",
            "coordinates": np.stack([self.coordinates.mean, self.coordinates.scale]),
            "shape": json.dumps(self.network.shape.config()),
            "context": self.context,
            "center": self.center,
            "cholesky": self.cholesky,
            **{f"state/{k}": v.numpy() for k, v in self.network.state_dict().items()},
        }


def latent_density(arrays: dict[str, Any]) -> LatentDensity:
    """The density that :meth:`LatentDensity.arrays` describes.

    Raises:
        KeyError, ValueError: it describes none.
    """
    kind, coordinates = str(arrays["kind"]), Coordinates(*arrays["coordinates"])
    if kind == "mixture":
        return LatentMixture(coordinates, arrays["weights"], arrays["means"], arrays["cholesky"])
    if kind != "flow":
        raise ValueError(f"no density of kind {kind!r} is known")
    state = {k.removeprefix("state/"): v for k, v in arrays.items() if k.startswith("state/")}
    with torch.random.fork_rng(devices=[]):
        network = FlowNetwork(FlowShape.of(json.loads(str(arrays["shape"]))))
    network.load_state_dict({k: torch.tensor(v) for k, v in state.items()})
    return LatentFlow(coordinates, arrays["context"], arrays["center"], arrays["cholesky"], network)
