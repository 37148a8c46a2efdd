"""Training of Transporter: pairs of frames, and a reconstruction loss that leaves the robot out."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from ..core.errors import InputError
from ..core.frames import Frames
from ..core.picture import Image
from .transporter_net import STRIDE, Transporter

#: Fewest frames that anything is learned from.
FEWEST = 8
#: Frames that differ by less than this on average show nothing that moves [grey levels of 255].
STILL = 0.02


@dataclass(frozen=True)
class Training:
    """How long and on what.

    Args:
        steps: of the optimiser.
        batch: pairs of frames a step.
        window: frames that the two of a pair lie apart at most; takes follow each other in the frames, and a pair near
            a seam may be of two takes.
        focus: how much more a pixel counts that differs between the two frames as much as pixels do on average; 0 as
            published: each counts the same, and an object of a hundredth of the picture next to nothing.
        rate: of Adam at the beginning; it falls to a tenth.
        seed: of the weights and the pairs.
    """

    steps: int = 600
    batch: int = 8
    window: int = 20
    focus: float = 0.0
    rate: float = 1e-3
    seed: int = 0


def train(
    net: Transporter,
    frames: Frames,
    size: int,
    how: Training,
    device: torch.device,
    progress: Callable[[str, int, int], None] | None = None,
) -> list[float]:
    """Train ``net`` in place; the loss of every step is returned.

    Raises:
        InputError: too few frames, or nothing moves in them.
    """
    if len(frames) < FEWEST:
        raise InputError(f"'transporter' learns from {FEWEST} frames or more, but got {len(frames)}")
    pictures = shrunk(frames.rgb, size)
    lag = min(how.window, len(pictures) - 1)
    moved = np.abs(pictures[lag:].astype(np.int16) - pictures[:-lag]).mean()
    if moved < STILL:
        raise InputError("nothing moves in these frames, so there is nothing to tell keypoints by; record a motion")
    kept = None if frames.robot is None else torch.from_numpy(_without_robot(frames.robot, pictures.shape[1:3]))
    rng = np.random.default_rng(how.seed)
    optimiser = torch.optim.Adam(net.parameters(), how.rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, how.steps, 0.1 * how.rate)
    net.to(device).train()
    losses = []
    for step in range(how.steps):
        one, other = _pairs(rng, len(pictures), how.batch, lag)
        source, target = (as_tensor(pictures[k]).to(device) for k in (one, other))
        weight = focused(source, target, how.focus)
        if kept is not None:
            weight = weight * (kept[one] * kept[other])[:, None].to(device)
        error = (net(source, target) - target) ** 2
        loss = (error * weight).sum() / (3.0 * weight.sum()).clamp(min=1.0)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        losses.append(float(loss.detach()))
        if progress is not None:
            progress("training", step + 1, how.steps)
    net.eval()
    return losses


def focused(one: Tensor, other: Tensor, focus: float) -> Tensor:
    """Weights ``(B, 1, H, W)`` of the pixels of pictures ``(B, 3, H, W)``: 1 where they are alike, more elsewhere."""
    differs = (one - other).abs().mean(dim=1, keepdim=True)
    return 1.0 + focus * differs / differs.mean().clamp(min=1e-6)


def shrunk(rgb: Image, size: int) -> Image:
    """Pictures ``(T, h, w, 3)`` of the working size: ``size`` along the longer edge, both multiples of 4."""
    height, width = rgb.shape[1:3]
    scale = size / max(height, width)
    h, w = (max(2 * STRIDE, STRIDE * round(side * scale / STRIDE)) for side in (height, width))
    return np.stack([cv2.resize(frame, (w, h), interpolation=cv2.INTER_AREA) for frame in rgb])


def as_tensor(pictures: Image) -> Tensor:
    """``(T, H, W, 3)`` as ``(T, 3, H, W)``, 0 to 1."""
    return torch.from_numpy(pictures).permute(0, 3, 1, 2).float() / 255.0


def _without_robot(robot: npt.NDArray[np.bool_], shape: tuple[int, ...]) -> npt.NDArray[np.float32]:
    """1 in the pixels ``(T, h, w)`` of the working size that show nothing of the robot, else 0."""
    h, w = shape
    shares = [cv2.resize(m.astype(np.float32), (w, h), interpolation=cv2.INTER_AREA) for m in robot]
    # its outline, too: a pixel in which it has any share tells where it is
    return np.asarray([cv2.dilate(s, np.ones((3, 3), np.uint8)) < 0.01 for s in shares], np.float32)


def _pairs(
    rng: np.random.Generator, count: int, batch: int, lag: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Numbers of source and target frames, different and at most ``lag`` apart."""
    one = rng.integers(count, size=batch)
    low, high = np.maximum(one - lag, 0), np.minimum(one + lag, count - 1)
    other = rng.integers(low, high)  # one place fewer, as the frame itself is left out
    return one, other + (other >= one)
