"""The mixture density head: full-covariance Gaussians as a function of features."""

import math

import torch
from torch import Tensor, nn

from .head import Head

# The log of a precision factor may move this far from where it starts; keeps a covariance from collapsing.
_RANGE = 6.0


class MixtureHead(Head):
    """Features to K Gaussians with full covariance, ``sum_k w_k N(z; m_k, (P_k^T P_k)^-1)``.

    ``P_k`` is lower triangular with a positive diagonal, so every output is a proper density: no projection onto
    the positive definite cone is ever needed. (Full-covariance mixture density network: Bishop 1994; used by
    BayesSim, Ramos et al. 2019.)

    Args:
        inputs: number of features.
        dim: D, the number of parameters.
        components: K.
        scale: ``(D,)`` standard deviations to start from.
    """

    def __init__(self, inputs: int, dim: int, components: int, scale: Tensor) -> None:
        super().__init__(inputs, dim)
        self.components = components
        self.below = dim * (dim - 1) // 2
        self.layer = nn.Linear(inputs, components * (1 + 2 * dim + self.below))
        with torch.no_grad():
            self.layer.weight.mul_(0.1)
            self.layer.bias.mul_(0.1)
        self.start: Tensor
        self.register_buffer("start", -torch.log(scale))

    def forward(self, features: Tensor, base: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Log weights ``(B, K)``, means ``(B, K, D)`` and precision factors ``(B, K, D, D)``.

        Args:
            features: ``(B, inputs)``.
            base: ``(B, D)``, added to every mean: a first guess that the network corrects.
        """
        k, d = self.components, self.dim
        logits, mean, diagonal, below = torch.split(self.layer(features), [k, k * d, k * d, k * self.below], dim=-1)
        spread = self.start.exp().reciprocal()
        means = base.unsqueeze(1) + mean.reshape(-1, k, d) * spread
        bounded = _RANGE * torch.tanh(diagonal.reshape(-1, k, d) / _RANGE)
        factor = torch.diag_embed((self.start + bounded).exp())
        if self.below:
            row, column = torch.tril_indices(d, d, offset=-1)
            off = torch.zeros_like(factor)
            off[:, :, row, column] = below.reshape(-1, k, self.below) * self.start.exp()[row]
            factor = factor + off
        return torch.log_softmax(logits, dim=-1), means, factor

    def log_prob(self, features: Tensor, base: Tensor, z: Tensor) -> Tensor:
        return mixture_log_prob(z, *self(features, base))


def mixture_log_prob(z: Tensor, log_weights: Tensor, means: Tensor, factors: Tensor) -> Tensor:
    """``(B,)`` log density of ``z (B, D)`` under the mixtures of :class:`MixtureHead`."""
    white = (factors @ (z.unsqueeze(1) - means).unsqueeze(-1)).squeeze(-1)
    log_det = torch.diagonal(factors, dim1=-2, dim2=-1).log().sum(-1)
    each = -0.5 * (white**2).sum(-1) + log_det - 0.5 * z.shape[-1] * math.log(2.0 * math.pi)
    return torch.logsumexp(log_weights + each, dim=-1)
