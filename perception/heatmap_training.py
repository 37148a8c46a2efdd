"""Training of ``heatmap``: augmentation, early stopping, and the confidence below which a keypoint is NaN."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import torch
from torch import Tensor

from ..core.arrays import FloatArray
from ..core.picture import Image
from .heatmap_net import MULTIPLE, STRIDE, HeatmapNet, log_shares
from .heatmap_peaks import gaussians, peaks

Progress = Callable[[str, int, int], None]
#: Of every so many pictures of a batch one shows nothing but a colour, and no keypoint is seen in it.
_BLANK_EVERY = 16


@dataclass(frozen=True)
class Training:
    """How long and on what.

    Args:
        epochs: at most.
        copies: augmented copies of every picture an epoch.
        batch: pictures a step.
        rate: the highest of AdamW; it rises over a fifth of the steps and falls over the rest.
        patience: epochs without a better loss on the held-out pictures after which it ends.
        held_out: share of the pictures that is not learned from; at least one.
        seed: of the weights, the augmentation and what is held out.
    """

    epochs: int = 30
    copies: int = 1
    batch: int = 16
    rate: float = 2e-3
    patience: int = 10
    held_out: float = 0.12
    seed: int = 0


@dataclass(frozen=True)
class Learned:
    """What came of it.

    Args:
        threshold: confidence below which a keypoint counts as not seen [1].
        error: median distance of seen keypoints on the held-out pictures [px of the working picture]; NaN if none.
        epochs: that were run.
        losses: on the held-out pictures after every epoch.
    """

    threshold: float
    error: float
    epochs: int
    losses: tuple[float, ...]


def shrunk(rgb: Image, size: int, shape: tuple[int, int] | None = None) -> Image:
    """Pictures ``(T, h, w, 3)`` of the working size, or of the height and width ``shape``.

    The longer edge has ``size`` pixels, or fewer where the frames are smaller; both are multiples of 32.
    """
    height, width = rgb.shape[1:3]
    scale = min(1.0, size / max(height, width))
    h, w = shape or tuple(max(MULTIPLE, MULTIPLE * round(side * scale / MULTIPLE)) for side in (height, width))
    if (h, w) == (height, width):
        return rgb
    # area averages what is shrunk; it would show blocks where something is enlarged
    way = cv2.INTER_AREA if h <= height and w <= width else cv2.INTER_LINEAR
    return np.stack([cv2.resize(frame, (w, h), interpolation=way) for frame in rgb])


def moved(points: FloatArray, given: tuple[int, int], wanted: tuple[int, int]) -> FloatArray:
    """``points (..., 2)`` [px] of pictures of ``given`` height and width in those of the ``wanted`` one."""
    scale = np.array([wanted[1] / given[1], wanted[0] / given[0]])
    return np.asarray((points + 0.5) * scale - 0.5)  # a pixel's middle is a whole number


def as_tensor(pictures: Image) -> Tensor:
    """``(T, H, W, 3)`` as ``(T, 3, H, W)``, 0 to 1."""
    return torch.from_numpy(np.ascontiguousarray(pictures)).permute(0, 3, 1, 2).float() / 255.0


def train(
    net: HeatmapNet,
    pictures: Image,
    keypoints: FloatArray,
    how: Training,
    device: torch.device,
    progress: Progress | None = None,
) -> Learned:
    """Train ``net`` in place on ``pictures (N, H, W, 3)`` with ``keypoints (N, K, 2)`` [px], NaN where not seen.

    The loss is the cross-entropy of the heatmaps to Gaussians around the keypoints. What is best on the held-out
    pictures is kept. Draws from torch's generator; seed it.
    """
    images, points = as_tensor(pictures), torch.from_numpy(keypoints).float()
    held, kept = _split(len(images), how)
    test = _Held(images[held], points[held], how.seed)
    augment = _augmentation()
    steps = max(1, -(-len(kept) * how.copies // how.batch))
    net.to(device)
    optimiser = torch.optim.AdamW(net.parameters(), how.rate, weight_decay=1e-4, fused=True)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, how.rate, total_steps=how.epochs * steps, pct_start=0.2)
    best, losses = (np.inf, {k: v.clone() for k, v in net.state_dict().items()}), list[float]()
    for epoch in range(how.epochs):
        net.train()
        order = torch.cat([kept[torch.randperm(len(kept))] for _ in range(how.copies)])
        for chosen in order.tensor_split(steps):
            batch = _with_blanks(*_augmented(augment, images[chosen], points[chosen]))
            loss = _loss(net, *(part.to(device) for part in batch))
            optimiser.zero_grad()
            torch.autograd.backward(loss)
            torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
            optimiser.step()
            schedule.step()
        losses.append(test.loss(net, device))
        if losses[-1] < best[0]:
            best = losses[-1], {k: v.clone() for k, v in net.state_dict().items()}
        if progress is not None:
            progress("training", epoch + 1, how.epochs)
        if len(losses) - 1 - int(np.argmin(losses)) >= how.patience:
            break
    net.load_state_dict(best[1])
    net.eval()
    threshold, error = test.calibrated(net, device)
    return Learned(threshold, error, len(losses), tuple(losses))


def _split(count: int, how: Training) -> tuple[Tensor, Tensor]:
    order = torch.from_numpy(np.random.default_rng(how.seed).permutation(count))
    least = max(1, round(how.held_out * count))
    return order[:least], order[least:]


def _loss(net: HeatmapNet, images: Tensor, points: Tensor) -> Tensor:
    logits = net(images)
    drawn = gaussians(_cells(points), (logits.shape[2], logits.shape[3])).flatten(2)
    wanted = torch.cat([drawn, 1.0 - drawn.sum(dim=2, keepdim=True)], dim=2)
    return -(wanted * log_shares(logits)).sum(dim=2).mean()


def _cells(points: Tensor) -> Tensor:
    """Pixels of the picture in cells of its heatmap."""
    return (points + 0.5) / STRIDE - 0.5


def located(net: HeatmapNet, images: Tensor, peak: str = "subpixel") -> tuple[FloatArray, FloatArray]:
    """Places ``(N, K, 2)`` [px of ``images (N, 3, H, W)``] and confidences ``(N, K)``."""
    with torch.no_grad():
        logits = net(images)
        shares = log_shares(logits)[..., :-1].exp().reshape(logits.shape)
        cells, sure = peaks(shares, "argmax" if peak == "argmax" else "subpixel")
    return ((cells + 0.5) * STRIDE - 0.5).cpu().numpy().astype(float), sure.cpu().numpy().astype(float)


def _augmentation() -> Callable[..., tuple[Tensor, Tensor]]:
    """Affine, lighting and colour changes of pictures and, where they move, of keypoints."""
    import kornia.augmentation as changes
    from kornia.constants import SamplePadding

    return changes.AugmentationSequential(
        changes.RandomAffine(
            degrees=10.0, translate=(0.1, 0.1), scale=(0.85, 1.15), padding_mode=SamplePadding.BORDER, p=0.9
        ),
        changes.RandomLinearIllumination(gain=(0.01, 0.25), p=0.5),
        changes.ColorJiggle(
            brightness=(0.7, 1.3), contrast=(0.7, 1.3), saturation=(0.6, 1.4), hue=(-0.08, 0.08), p=0.8
        ),
        data_keys=["input", "keypoints"],
    )


def _augmented(augment: Callable[..., tuple[Tensor, Tensor]], images: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
    """Changed pictures and keypoints; NaN where a keypoint has left the picture."""
    images, points = augment(images, points)
    edge = torch.tensor([images.shape[3] - 0.5, images.shape[2] - 0.5])
    inside = ((points >= -0.5) & (points <= edge)).all(dim=2, keepdim=True)
    return images.clamp(0.0, 1.0), torch.where(inside, points, torch.nan)


def _with_blanks(images: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
    """Some pictures of one colour each at the end, in which nothing is seen."""
    count = max(1, len(images) // _BLANK_EVERY)
    blank = torch.rand(count, 3, 1, 1).expand(count, *images.shape[1:])
    return torch.cat([images, blank]), torch.cat([points, torch.full((count, *points.shape[1:]), torch.nan)])


class _Held:
    """Pictures that are not learned from, as they are and augmented, so that keypoints leave some of them."""

    def __init__(self, images: Tensor, points: Tensor, seed: int) -> None:
        torch.manual_seed(seed + 1)
        changed = [_augmented(_augmentation(), images, points) for _ in range(max(1, 12 // len(images)))]
        parts = [(images, points), *changed]
        self.images, self.points = _with_blanks(torch.cat([p[0] for p in parts]), torch.cat([p[1] for p in parts]))
        self.plain = len(images)

    def loss(self, net: HeatmapNet, device: torch.device) -> float:
        net.eval()
        with torch.no_grad():
            return float(_loss(net, self.images.to(device), self.points.to(device)))

    def calibrated(self, net: HeatmapNet, device: torch.device) -> tuple[float, float]:
        """The threshold that tells seen from unseen keypoints best, and the median error of those seen [px]."""
        places, sure = located(net, self.images.to(device))
        truth = self.points.numpy()
        seen = np.isfinite(truth).all(axis=2)
        apart = np.linalg.norm(places - truth, axis=2)[: self.plain]
        near = apart[seen[: self.plain]]
        return best_threshold(sure[seen], sure[~seen]), float(np.median(near)) if len(near) else float("nan")


def best_threshold(seen: FloatArray, unseen: FloatArray) -> float:
    """The confidence that tells seen from unseen keypoints with fewest mistakes, as shares of either kind.

    Where several are as good, the middle of them, between 0.05 and 0.95.

    References:
        Youden, *Index for rating diagnostic tests*, 1950.
    """
    grid = np.linspace(0.05, 0.95, 181)
    wrong = np.zeros(len(grid))
    if len(seen):
        wrong += (seen[:, None] < grid).mean(axis=0)
    if len(unseen):
        wrong += (unseen[:, None] >= grid).mean(axis=0)
    best = grid[wrong <= wrong.min() + 1e-9]
    return float(best[len(best) // 2])
