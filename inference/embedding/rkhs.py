"""The RKHS layer: every frame's set of points as an empirical kernel mean of random Fourier features."""

import math

import torch
from torch import Tensor, nn


class RKHSEmbedding(nn.Module):
    """Kernel mean embedding of point sets with learned frequencies and bandwidth (the paper's RKHS layer).

    ``mu = 1/n sum_n phi(x_n)`` over the n points seen, ``phi(x) = 1/sqrt(M) [cos(v_m^T x), sin(v_m^T x)]_m`` with
    ``v_m = w_m / sigma``; ``w`` starts as N(0, I), ``sigma`` (one an input coordinate) as ``bandwidth``, and both
    are parameters of the network (Antonova et al., BayesSim-RKHS). Permutation-invariant, because it is a mean.

    Ours, beside the mean: ``log n`` and ``1/sqrt(n)``, the size of the set and the scale of the mean's own
    sampling error, which a mean alone forgets.

    Args:
        inputs: coordinates of a point.
        features: M, the number of frequencies; the embedding has 2 M + 2 numbers, or 2 M without the size.
        bandwidth: where sigma starts [standardised coordinates].
        generator: source of the initial frequencies.
        size: whether the size stands beside the mean; the paper's layer has the mean alone.
    """

    def __init__(
        self, inputs: int, features: int, bandwidth: float, generator: torch.Generator, size: bool = True
    ) -> None:
        super().__init__()
        self.size = size
        self.frequencies = nn.Parameter(torch.randn(inputs, features, generator=generator))
        self.log_bandwidth = nn.Parameter(torch.full((inputs,), math.log(bandwidth)))

    @property
    def outputs(self) -> int:
        """Length of a frame's embedding."""
        return 2 * int(self.frequencies.shape[1]) + (2 if self.size else 0)

    def forward(self, points: Tensor, seen: Tensor) -> Tensor:
        """``(..., P, inputs)`` points and a ``(..., P)`` mask to ``(..., outputs)``.

        A frame without any point seen has a mean of zero, and the size features of half a point.
        """
        phase = points @ (self.frequencies / self.log_bandwidth.exp()[:, None])
        weight = seen.to(points.dtype).unsqueeze(-2)
        count = weight.sum(dim=-1)
        total = torch.cat([weight @ torch.cos(phase), weight @ torch.sin(phase)], dim=-1).squeeze(-2)
        mean = total / (count.clamp(min=1.0) * math.sqrt(self.frequencies.shape[1]))
        if not self.size:
            return mean
        size = count.clamp(min=0.5)
        return torch.cat([mean, torch.log(size), torch.rsqrt(size)], dim=-1)
