"""The last layer of a network: features and a first guess to a density, or to its mean alone."""

from abc import ABC, abstractmethod
from typing import Literal

import torch
from torch import Tensor, nn


class Head(nn.Module, ABC):
    """Features to the density of the parameters.

    Args:
        inputs: number of features.
        dim: D, the number of parameters.
    """

    def __init__(self, inputs: int, dim: int) -> None:
        super().__init__()
        self.inputs, self.dim = inputs, dim

    @abstractmethod
    def log_prob(self, features: Tensor, base: Tensor, z: Tensor) -> Tensor:
        """``(B,)`` log density of ``z (B, D)`` given features ``(B, inputs)`` and a first guess ``(B, D)``."""


class MeanHead(Head):
    """Features to a mean alone; its spread is found afterwards, on draws that were left out.

    Args:
        inputs, dim: as of :class:`Head`.
        scale: ``(D,)`` unit of the errors; the network's output times it is added to the first guess.
        error: ``"l1"`` trains for the median (a Laplace density), ``"l2"`` for the mean (a Gaussian one).
    """

    def __init__(self, inputs: int, dim: int, scale: Tensor, error: Literal["l1", "l2"]) -> None:
        super().__init__(inputs, dim)
        self.layer = nn.Linear(inputs, dim)
        self.error = error
        with torch.no_grad():
            self.layer.weight.mul_(0.1)
            self.layer.bias.zero_()
        self.scale: Tensor
        self.register_buffer("scale", scale)

    def forward(self, features: Tensor, base: Tensor) -> Tensor:
        """``(B, D)`` means."""
        mean: Tensor = base + self.layer(features) * self.scale
        return mean

    def log_prob(self, features: Tensor, base: Tensor, z: Tensor) -> Tensor:
        """Up to a constant."""
        left = (z - self(features, base)) / self.scale
        loss: Tensor = left.abs() if self.error == "l1" else 0.5 * left**2
        return -loss.sum(-1)
