"""The training draws of an estimator as tensors."""

from dataclasses import dataclass

import torch
from torch import Tensor

from ...core.arrays import FloatArray
from ..embedding.summaries import probit


@dataclass(frozen=True, eq=False)
class Draws:
    """Parameters of the training draws.

    Args:
        unit: ``(N, D)`` in the unit cube, float64.
        latent: ``(N, D)``, the same in probit coordinates.
        weights: ``(N,)`` of mean one.
    """

    unit: Tensor
    latent: Tensor
    weights: Tensor

    @classmethod
    def of(cls, theta: FloatArray, weights: FloatArray) -> "Draws":
        """From arrays that were checked."""
        unit = torch.tensor(theta)
        return cls(unit, probit(unit), torch.tensor(weights))

    def among(self, rows: Tensor) -> "Draws":
        """Those of some rows, bool ``(N,)``; their weights again have a mean of one."""
        weights = self.weights[rows]
        return Draws(self.unit[rows], self.latent[rows], weights / weights.mean())
