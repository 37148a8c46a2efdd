"""Learning the RKHS layer: the paper's network on embedded trajectories, and rows made with what it learned."""

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from ...core.arrays import FloatArray
from ..embedding.encoder import Encoder
from ..embedding.rkhs import RKHSEmbedding
from ..embedding.rows import Rows
from .head import Head
from .networks import TrajectoryNetwork
from .training import train


@dataclass(frozen=True)
class LayerPlan:
    """How the layer is made and learned.

    Args:
        features, bandwidth, size: of :class:`~..embedding.rkhs.RKHSEmbedding`.
        hidden: widths of the fully connected layers on it.
        learning_rate, max_epochs, patience, batch: of :func:`~.training.train`; a fifth of the draws is left out, or
            none when patience is 0.
        frames, points: how many a recording or frame it sees while it learns, evenly spread; 0 for all.
    """

    features: int
    bandwidth: float
    hidden: tuple[int, ...]
    learning_rate: float
    max_epochs: int
    patience: int
    batch: int
    frames: int
    points: int
    size: bool


class KernelMeanRows(Rows):
    """Every frame's kernel mean under a learned layer; where points correspond, their coordinates too.

    Args:
        encoder: made from the training draws.
        points, seen: what it gives for them.
        target: ``(N, D)``, what the network on the layer learns.
        weights: ``(N,)``.
        head: of that network.
        guess: ``(D,)``, the head's first guess.
        plan: how the layer is made and learned.
        generator: of all that is random.

    Attributes:
        network: the network on the layer.
        held: ``(n,)`` the draws it left out.
    """

    def __init__(
        self,
        encoder: Encoder,
        points: list[Tensor],
        seen: list[Tensor],
        target: Tensor,
        weights: Tensor,
        head: Head,
        guess: Tensor,
        plan: LayerPlan,
        generator: torch.Generator,
    ) -> None:
        self.encoder, self.plan = encoder, plan
        inputs, masks = encoder.coded(points, seen, plan.frames, plan.points)
        layer = RKHSEmbedding(encoder.inputs, plan.features, plan.bandwidth, generator, plan.size)
        self.network = TrajectoryNetwork(layer, inputs, masks, plan.hidden, head, guess.float())
        held = torch.zeros(len(target), dtype=torch.bool)
        if plan.patience:
            held[torch.randperm(len(target), generator=generator)[: max(2, len(target) // 5)]] = True
        self.held = torch.nonzero(held).flatten()
        train(
            self.network, [*inputs, *masks], target.float(), weights.float(), held, generator,
            learning_rate=plan.learning_rate, weight_decay=0.0, batch=plan.batch, max_epochs=plan.max_epochs,
            patience=plan.patience,
        )  # fmt: skip

    def outputs(self, points: list[Tensor], seen: list[Tensor]) -> Any:
        """What the network itself says of encoded recordings."""
        inputs, masks = self.encoder.coded(points, seen, self.plan.frames, self.plan.points)
        return self.network(*inputs, *masks)

    def blocks(self, points: list[Tensor], seen: list[Tensor]) -> list[Tensor]:
        """Rows of encoded recordings."""
        return self.encoder.blocks(self.network.embedding, points, seen)

    def __call__(self, x: list[FloatArray]) -> list[Tensor]:
        return self.blocks(*self.encoder.points(x))
