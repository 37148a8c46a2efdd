"""From recordings to what the networks read: standardised coded points, and summaries of all frames."""

import numpy as np
import torch
from torch import Tensor

from ...core.arrays import FloatArray
from ...core.errors import InputError
from .components import PrincipalComponents
from .points import PointScaler
from .rkhs import RKHSEmbedding

# Extra coordinates that tell corresponding points apart in the kernel.
_CODE = 2
# Draws embedded at a time, by the numbers this makes: keeps clouds of thousands of points in memory.
_CHUNK = 4_000_000


class Encoder:
    """Standardises recordings and codes the identity of their points.

    Where points correspond, what enters the kernel is (position, a fixed random code of the marker), so that the
    mean over a frame's points still knows which marker moved. Where they do not, it is the position alone. Gaps in
    corresponding points are filled in from the other markers and frames, so that a marker lost in the measurement
    does not look like one that moved.

    Args:
        x: training draws, ``(N, T_r, P, A)`` a recording.
        correspondence: one flag a recording.
        principal: principal components used to fill in gaps.
        generator: source of the codes.
    """

    def __init__(
        self, x: list[FloatArray], correspondence: tuple[bool, ...], principal: int, generator: torch.Generator
    ) -> None:
        self.scalers = [PointScaler.fit(a, c) for a, c in zip(x, correspondence, strict=True)]
        self.inputs = x[0].shape[3] + (_CODE if any(correspondence) else 0)
        self.codes = torch.randn(max(a.shape[2] for a in x), _CODE, generator=generator)
        self.gaps: list[tuple[Tensor, PrincipalComponents] | None] = []
        for a, scaler in zip(x, self.scalers, strict=True):
            if scaler.points is None:
                self.gaps.append(None)
                continue
            z, seen = (torch.tensor(v) for v in scaler.transform(a))
            mask = seen.unsqueeze(-1).expand_as(z).flatten(1)
            mean = z.flatten(1).sum(0) / mask.sum(0).clamp(min=1)
            self.gaps.append((mean, PrincipalComponents(_centred(z.flatten(1), mean, mask), mask, principal)))

    def points(self, x: list[FloatArray]) -> tuple[list[Tensor], list[Tensor]]:
        """Standardised points ``(N, T, P, A)`` (float64), gaps of corresponding ones filled in, and what was seen."""
        if len(x) != len(self.scalers):
            raise InputError(f"the estimator was trained on {len(self.scalers)} recordings, but got {len(x)}")
        points, masks = [], []
        for a, scaler, gaps in zip(x, self.scalers, self.gaps, strict=True):
            z, seen = (torch.tensor(v) for v in scaler.transform(np.asarray(a, float)))
            if gaps is not None and not bool(seen.all()):
                mean, components = gaps
                mask = seen.unsqueeze(-1).expand_as(z).flatten(1)
                z = (mean + components.complete(_centred(z.flatten(1), mean, mask), mask)).reshape(z.shape)
            points.append(z)
            masks.append(seen)
        return points, masks

    def coded(
        self, points: list[Tensor], seen: list[Tensor], frames: int, count: int
    ) -> tuple[list[Tensor], list[Tensor]]:
        """Kernel inputs ``(N, F, P', C)`` and masks of some evenly spread frames and points (0: all), float32."""
        inputs, masks = [], []
        for z, mask, scaler in zip(points, seen, self.scalers, strict=True):
            rows = _spread(z.shape[1], frames)
            # Sets are in sorted order here, so a stride picks the same points in whatever order they came.
            columns = _spread(z.shape[2], count)
            part, kept = z[:, rows][:, :, columns].float(), mask[:, rows][:, :, columns]
            extra = self.inputs - part.shape[-1]
            if scaler.points is None:
                inputs.append(torch.nn.functional.pad(part, (0, extra)))
                masks.append(kept)
            else:
                tags = self.codes[columns].expand(*part.shape[:3], extra)
                inputs.append(torch.cat([part, tags], dim=-1))
                # Filled-in points count as seen here.
                masks.append(torch.ones_like(kept))
        return inputs, masks

    def embedded(self, layer: RKHSEmbedding, points: list[Tensor], seen: list[Tensor], frames: int) -> Tensor:
        """``(N, sum_r T_r (2 M + 2))`` float64: every frame's kernel mean under a trained layer."""
        inputs, masks = self.coded(points, seen, frames, 0)
        blocks = []
        with torch.no_grad():
            for z, mask in zip(inputs, masks, strict=True):
                size = max(1, _CHUNK // (z[0, ..., 0].numel() * layer.outputs))
                rows = [layer(z[i : i + size], mask[i : i + size]).flatten(1) for i in range(0, len(z), size)]
                blocks.append(torch.cat(rows).double())
        return torch.cat(blocks, dim=1)

    def blocks(self, layer: RKHSEmbedding, points: list[Tensor], seen: list[Tensor]) -> list[Tensor]:
        """Rows for summaries: embedded frames, and the coordinates themselves of points that correspond."""
        rows = [self.embedded(layer, points, seen, 0)]
        known = [z.flatten(1) for z, s in zip(points, self.scalers, strict=True) if s.points is not None]
        return [*rows, torch.cat(known, dim=1)] if known else rows


def _centred(rows: Tensor, mean: Tensor, seen: Tensor) -> Tensor:
    """Rows less their mean, zero where not seen."""
    return torch.where(seen, rows - mean, torch.zeros_like(rows))


def _spread(length: int, count: int) -> Tensor:
    """Indices of ``count`` entries evenly spread over ``length``, the last among them; all when count is 0."""
    if count == 0 or count >= length:
        return torch.arange(length)
    return torch.linspace(0, length - 1, count).round().long()
