"""The two networks under a head: the paper's, on whole trajectories, and a small one on summaries."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn

from ..embedding.rkhs import RKHSEmbedding
from .head import Head
from .training import DensityNetwork

# Draws embedded at a time for the statistics of their embeddings.
_CHUNK = 64


def _layers(inputs: int, hidden: Sequence[int], activation: type[nn.Module]) -> nn.Sequential:
    layers: list[nn.Module] = []
    for width in hidden:
        layers += [nn.Linear(inputs, width), activation()]
        inputs = width
    return nn.Sequential(*layers)


class TrajectoryNetwork(DensityNetwork):
    """The paper's network: RKHS layer per frame, fully connected layers, a head.

    Ours: the frames' embeddings are standardised by statistics of the training draws before the first layer (fixed
    buffers, so the layer stays the paper's up to an affine map).

    Args:
        embedding: the RKHS layer, shared by all frames and recordings.
        points, seen: the training draws, ``(N, F, P, C)`` and ``(N, F, P)`` a recording.
        hidden: widths of the fully connected layers; the last is what the head takes.
        head: what makes of features a density.
        guess: ``(D,)``, the head's first guess, the same for all draws.
    """

    def __init__(
        self,
        embedding: RKHSEmbedding,
        points: list[Tensor],
        seen: list[Tensor],
        hidden: Sequence[int],
        head: Head,
        guess: Tensor,
    ) -> None:
        super().__init__()
        self.embedding = embedding
        with torch.no_grad():
            rows = [
                self._embed([p[i : i + _CHUNK] for p in points], [s[i : i + _CHUNK] for s in seen])
                for i in range(0, len(points[0]), _CHUNK)
            ]
        flat = torch.cat(rows)
        self.shift: Tensor
        self.spread: Tensor
        self.guess: Tensor
        self.register_buffer("shift", flat.mean(0))
        # Entries that do not vary keep their unit, so that they stay near zero instead of becoming rounding noise.
        sd = flat.std(0)
        self.register_buffer("spread", torch.where(sd > 1e-5, sd, torch.ones_like(sd)))
        self.register_buffer("guess", guess)
        self.layers = _layers(flat.shape[1], hidden, nn.ReLU)
        self.head = head

    def _embed(self, points: list[Tensor], seen: list[Tensor]) -> Tensor:
        return torch.cat([self.embedding(p, s).flatten(1) for p, s in zip(points, seen, strict=True)], dim=1)

    def _features(self, inputs: Sequence[Tensor]) -> tuple[Tensor, Tensor]:
        half = len(inputs) // 2
        flat = (self._embed(list(inputs[:half]), list(inputs[half:])) - self.shift) / self.spread
        return self.layers(flat), self.guess.expand(len(flat), -1)

    def forward(self, *inputs: Tensor) -> Any:
        """What the head makes of the recordings' points and, after them, their masks."""
        return self.head(*self._features(inputs))

    def log_prob(self, inputs: Sequence[Tensor], z: Tensor) -> Tensor:
        return self.head.log_prob(*self._features(inputs), z)


class SummaryNetwork(DensityNetwork):
    """Summaries to a density: it corrects a first guess of the mean and learns the shape around it.

    Args:
        features: number of summaries.
        hidden, head: as of :class:`TrajectoryNetwork`.
    """

    def __init__(self, features: int, hidden: Sequence[int], head: Head) -> None:
        super().__init__()
        self.layers = _layers(features, hidden, nn.Tanh)
        self.head = head

    def forward(self, features: Tensor, base: Tensor) -> Any:
        return self.head(self.layers(features), base)

    def log_prob(self, inputs: Sequence[Tensor], z: Tensor) -> Tensor:
        features, base = inputs
        return self.head.log_prob(self.layers(features), base, z)
