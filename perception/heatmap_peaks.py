"""Gaussian heatmaps, and where their peaks are to a fraction of a cell."""

from typing import Literal

import torch
from torch import Tensor

Peak = Literal["subpixel", "argmax"]
#: Standard deviation of a heatmap [cells].
SIGMA = 1.5
#: Cells on either side of the highest one in which a peak is located, and its confidence is summed up.
_REACH = 4


def gaussians(cells: Tensor, shape: tuple[int, int]) -> Tensor:
    """Heatmaps ``(N, K, h, w)`` of sum one around ``cells (N, K, 2)``, right and down; zero where those are NaN."""
    h, w = shape
    seen = cells.isfinite().all(dim=-1)
    place = torch.where(seen[..., None], cells, 0.0)
    across = torch.arange(w, device=cells.device, dtype=cells.dtype) - place[..., :1]
    down = torch.arange(h, device=cells.device, dtype=cells.dtype) - place[..., 1:]
    # one axis at a time, and each normalised as softmax does: it cannot run under far from all cells
    shares = [torch.softmax(-0.5 * (axis / SIGMA) ** 2, dim=-1) for axis in (across, down)]
    drawn: Tensor = shares[1][..., :, None] * shares[0][..., None, :] * seen[..., None, None]
    return drawn


def peaks(shares: Tensor, peak: Peak = "subpixel") -> tuple[Tensor, Tensor]:
    """Where heatmaps ``(N, K, h, w)`` are highest.

    Args:
        shares: not below zero; a heatmap sums to one at most.
        peak: ``"argmax"``: the middle of the highest cell; ``"subpixel"``: the mean over the cells around it, weighted
            by what they hold.

    Returns:
        Places ``(N, K, 2)`` [cells], right and down, and the share of a heatmap that lies around them ``(N, K)``.

    References:
        Nibali et al., *Numerical coordinate regression with convolutional neural networks*, 2018: the mean, here over
        the neighbourhood of the peak alone, so that a second one does not draw it away.
    """
    h, w = shares.shape[2:]
    best = shares.flatten(2).argmax(dim=2)
    column, row = best % w, best // w
    near_column = (torch.arange(w, device=shares.device) - column[..., None]).abs() <= _REACH
    near_row = (torch.arange(h, device=shares.device) - row[..., None]).abs() <= _REACH
    near = shares * (near_row[..., :, None] & near_column[..., None, :])
    total = near.sum(dim=(2, 3))
    if peak == "argmax":
        return torch.stack([column, row], dim=-1).to(shares.dtype), total
    scale = total.clamp(min=1e-12)
    u = (near.sum(dim=2) * torch.arange(w, device=shares.device)).sum(dim=-1) / scale
    v = (near.sum(dim=3) * torch.arange(h, device=shares.device)).sum(dim=-1) / scale
    return torch.stack([u, v], dim=-1), total
