"""Rows as they are, standardised: what a network reads when no summary is made of them."""

import torch
from torch import Tensor


class PlainRows:
    """Standardised rows as features and the prior as first guess; stands where :class:`~.summaries.Summaries` does.

    Args:
        blocks: rows ``(N, F_b)`` of each kind.
        targets: ``(N, D)`` in probit coordinates.

    Attributes:
        training: features and guesses ``(N, D)`` of the training draws.
        residual: ``(D,)`` root mean square error of those guesses.
    """

    def __init__(self, blocks: list[Tensor], targets: Tensor) -> None:
        rows = torch.cat(blocks, dim=1)
        sd = rows.std(0)
        self.center = rows.mean(0)
        # Entries that do not vary keep their unit, so that they stay near zero instead of becoming rounding noise.
        self.spread = torch.where(sd > 1e-6, sd, torch.ones_like(sd))
        self.dim = targets.shape[1]
        self.training = self(blocks)
        self.residual = targets.square().mean(0).sqrt().clamp(min=1e-3)

    def __call__(self, blocks: list[Tensor]) -> tuple[Tensor, Tensor]:
        """New rows of each kind to features and first guesses ``(B, D)``, the middle of the prior."""
        features = (torch.cat(blocks, dim=1) - self.center) / self.spread
        return features, torch.zeros(len(features), self.dim, dtype=features.dtype)
