"""The time model: frames' kernel means to a few features, by a convolution over time and attention pooling."""

import torch
from torch import Tensor, nn

from .rkhs import RKHSEmbedding

_KERNEL = 5
_HEADS = 4


class TimeModel(nn.Module):
    """Features of a trajectory of point sets, learned.

    Every frame is embedded by the RKHS layer and, with its place in time beside it, mapped to ``width`` numbers; a
    1-D convolution with a residual connection mixes neighbouring frames; attention (one learned query a head) says
    which frames matter and takes their mean (Vaswani et al. 2017; pooling by attention: Lee et al. 2019). With one
    frame it is a network on a set.

    Args:
        layer: the RKHS layer, shared by all frames and recordings.
        recordings: how many there are; each is pooled by itself.
        width: numbers a frame.
        features: how many come out.
    """

    def __init__(self, layer: RKHSEmbedding, recordings: int, width: int, features: int) -> None:
        super().__init__()
        self.layer = layer
        self.frame = nn.Linear(layer.outputs + 1, width)
        self.mix = nn.Conv1d(width, width, _KERNEL, padding=_KERNEL // 2)
        self.query = nn.Linear(width, _HEADS)
        self.out = nn.Linear(recordings * _HEADS * width, features)
        # A kernel mean is of the size 1/sqrt(M); the layer after it expects numbers of the size one.
        self.gain = (layer.outputs / 2.0) ** 0.5

    def forward(self, points: list[Tensor], seen: list[Tensor]) -> Tensor:
        """``(B, T_r, P_r, C)`` points and ``(B, T_r, P_r)`` masks, one a recording, to ``(B, features)``."""
        pooled = [self._pooled(p, s) for p, s in zip(points, seen, strict=True)]
        return torch.tanh(self.out(torch.cat(pooled, dim=1)))

    def _pooled(self, points: Tensor, seen: Tensor) -> Tensor:
        mean = self.layer(points, seen)
        mean = torch.cat([mean[..., :-2] * self.gain, mean[..., -2:]], dim=-1)
        place = torch.linspace(-1.0, 1.0, points.shape[1]).to(mean)[None, :, None].expand(len(mean), -1, 1)
        frames = torch.nn.functional.elu(self.frame(torch.cat([mean, place], dim=-1)))
        mixed = frames + torch.nn.functional.elu(self.mix(frames.transpose(1, 2)).transpose(1, 2))
        attention = torch.softmax(self.query(mixed), dim=1)
        return torch.einsum("bth,btw->bhw", attention, mixed).flatten(1)
