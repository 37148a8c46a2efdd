"""The two networks: the paper's, on whole trajectories, and a small one on summaries."""

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from ..embedding.rkhs import RKHSEmbedding
from .mixture_head import MixtureHead, mixture_log_prob
from .training import DensityNetwork

Mixture = tuple[Tensor, Tensor, Tensor]


def _layers(inputs: int, hidden: Sequence[int], activation: type[nn.Module]) -> tuple[nn.Sequential, int]:
    layers: list[nn.Module] = []
    for width in hidden:
        layers += [nn.Linear(inputs, width), activation()]
        inputs = width
    return nn.Sequential(*layers), inputs


class TrajectoryNetwork(DensityNetwork):
    """The paper's network: RKHS layer per frame, fully connected layers, full-covariance mixture density.

    Ours: the frames' embeddings are standardised by statistics of the training draws before the first layer (fixed
    buffers, so the layer stays the paper's up to an affine map).

    Args:
        embedding: the RKHS layer, shared by all frames and recordings.
        points, seen: the training draws, ``(N, F, P, C)`` and ``(N, F, P)`` a recording.
        dim: D.
        hidden: widths of the fully connected layers.
        components: K.
        scale: ``(D,)`` standard deviation of the targets.
    """

    def __init__(
        self,
        embedding: RKHSEmbedding,
        points: list[Tensor],
        seen: list[Tensor],
        dim: int,
        hidden: Sequence[int],
        components: int,
        scale: Tensor,
    ) -> None:
        super().__init__()
        self.embedding = embedding
        with torch.no_grad():
            rows = [
                self._embed([p[i : i + 64] for p in points], [s[i : i + 64] for s in seen])
                for i in range(0, len(points[0]), 64)
            ]
        flat = torch.cat(rows)
        self.shift: Tensor
        self.spread: Tensor
        self.register_buffer("shift", flat.mean(0))
        # Entries that do not vary keep their unit, so that they stay near zero instead of becoming rounding noise.
        sd = flat.std(0)
        self.register_buffer("spread", torch.where(sd > 1e-5, sd, torch.ones_like(sd)))
        self.layers, last = _layers(flat.shape[1], hidden, nn.ReLU)
        self.head = MixtureHead(last, dim, components, scale)

    def _embed(self, points: list[Tensor], seen: list[Tensor]) -> Tensor:
        return torch.cat([self.embedding(p, s).flatten(1) for p, s in zip(points, seen, strict=True)], dim=1)

    def forward(self, *inputs: Tensor) -> Mixture:
        """Inputs: the recordings' points, then their masks."""
        half = len(inputs) // 2
        flat = (self._embed(list(inputs[:half]), list(inputs[half:])) - self.shift) / self.spread
        features = self.layers(flat)
        return self.head(features, features.new_zeros(len(flat), self.head.dim))  # type: ignore[no-any-return]

    def log_prob(self, inputs: Sequence[Tensor], z: Tensor) -> Tensor:
        return mixture_log_prob(z, *self(*inputs))


class SummaryNetwork(DensityNetwork):
    """Summaries to a mixture: it corrects a first guess of the mean and learns the shape around it.

    Args:
        features: number of summaries.
        dim, hidden, components, scale: as of :class:`TrajectoryNetwork`.
    """

    def __init__(self, features: int, dim: int, hidden: Sequence[int], components: int, scale: Tensor) -> None:
        super().__init__()
        self.layers, last = _layers(features, hidden, nn.Tanh)
        self.head = MixtureHead(last, dim, components, scale)

    def forward(self, features: Tensor, base: Tensor) -> Mixture:
        return self.head(self.layers(features), base)  # type: ignore[no-any-return]

    def log_prob(self, inputs: Sequence[Tensor], z: Tensor) -> Tensor:
        features, base = inputs
        return mixture_log_prob(z, *self(features, base))
