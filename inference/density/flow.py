"""The conditional normalizing flow: autoregressive rational-quadratic splines, by zuko."""

import importlib
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import torch
from torch import Tensor, nn

from ...core.errors import InputError
from .training import DensityNetwork

# The last layers start this much smaller than usual: every transform starts near the identity, and so the density
# near the Gaussian that the targets have been whitened by.
_START = 0.1


def _zuko() -> Any:
    try:
        return importlib.import_module("zuko")
    except ImportError as error:
        raise InputError(f"normalizing flows need zuko: pip install 'muslin[torch]' ({error})") from error


@dataclass(frozen=True)
class FlowShape:
    """What it takes to build a flow again: number of features and of parameters, and its size."""

    features: int
    dim: int
    transforms: int
    hidden: tuple[int, ...]
    bins: int

    def config(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)

    @classmethod
    def of(cls, config: dict[str, Any]) -> "FlowShape":
        """From JSON."""
        return cls(**{**config, "hidden": tuple(config["hidden"])})


class FlowNetwork(DensityNetwork):
    """Neural spline flow, autoregressive, with a random order of the parameters in every transform.

    (Durkan et al. 2019; Papamakarios et al. 2017.) Splines act on [-5, 5] and are the identity outside: the map is
    one-to-one on all of R^D, so the density is normalised exactly.

    Raises:
        InputError: zuko is not installed.
    """

    def __init__(self, shape: FlowShape) -> None:
        super().__init__()
        self.shape, self.dim = shape, shape.dim
        self.flow = _zuko().flows.NSF(
            shape.dim,
            shape.features,
            bins=shape.bins,
            transforms=shape.transforms,
            hidden_features=shape.hidden,
            activation=nn.ELU,
            randperm=True,
        )
        with torch.no_grad():
            for transform in self.flow.transform.transforms:
                transform.hyper[-1].weight.mul_(_START)
                transform.hyper[-1].bias.mul_(_START)

    def log_prob(self, inputs: Sequence[Tensor], z: Tensor) -> Tensor:
        noise, log_det = self.flow.transform(inputs[0]).call_and_ladj(z)
        log_p: Tensor = log_det - 0.5 * (noise**2).sum(-1) - 0.5 * self.dim * math.log(2.0 * math.pi)
        return log_p

    def push(self, context: Tensor, noise: Tensor) -> Tensor:
        """Standard normal noise ``(B, D)`` to draws at ``context (B, F)``."""
        drawn: Tensor = self.flow.transform(context).inv(noise)
        return drawn
