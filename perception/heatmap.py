"""Keypoints from annotated frames: one heatmap a keypoint."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt
import torch

from ..core.arrays import FloatArray
from ..core.errors import InputError
from ..core.frames import Frames
from ..core.series import PointSeries
from ..core.version import __version__
from .heatmap_net import HeatmapNet
from .heatmap_peaks import Peak
from .heatmap_training import Learned, Training, as_tensor, located, moved, shrunk, train
from .learned import LearnedExtractor

Preset = Literal["small", "paper"]
#: Working size [px], stages of ResNet-34 and training of each preset; 12 copies make 3000 pictures of 250.
PRESETS: dict[str, tuple[int, int, Training]] = {
    "small": (64, 3, Training()),
    "paper": (320, 4, Training(epochs=40, copies=12)),
}
#: Fewest frames that anything is learned from.
FEWEST = 4
#: Frames that go through the network together.
_BATCH = 16


class HeatmapExtractor(LearnedExtractor):
    """Learns from annotated frames where keypoints are, and where they are hidden.

    Args:
        weights: file that :meth:`save` wrote; empty: :meth:`fit` comes first.
        peak: ``"subpixel"``, or ``"argmax"`` as in the paper: the middle of the highest cell.
        threshold: confidence below which a keypoint is NaN; None: the one that told seen from unseen keypoints best
            on frames held out from training.
        preset: ``"small"``: pictures of 64 pixels and three of the backbone's four stages, minutes on two cores;
            ``"paper"``: 320 pixels, all of it, and twelve augmented copies of every frame an epoch, for a GPU.
        size: pixels of the longer edge of the working picture, where not that of the preset.
        epochs: of training at most, where not those of the preset.
        seed: of the training.
        device: ``"auto"`` (a GPU where there is one), ``"cpu"`` or ``"cuda"``.

    Raises:
        InputError: an option that cannot be; MissingFileError: no such file of weights.

    References:
        Grannen, Sundaresan et al., *Untangling dense knots by learning task-relevant keypoints*, 2020: annotated and
            augmented pictures, one Gaussian heatmap a keypoint.
        He et al., *Deep Residual Learning for Image Recognition*, 2016: the backbone, ResNet-34.
    """

    name: ClassVar[str] = "heatmap"
    described: ClassVar[tuple[str, ...]] = ("keypoints", "stages", "height", "width", "threshold")
    reports_unseen: ClassVar[bool] = True
    quick: ClassVar[Mapping[str, object]] = {"epochs": 8, "size": 32}

    def __init__(
        self,
        weights: str | Path = "",
        peak: Peak = "subpixel",
        threshold: float | None = None,
        preset: Preset = "small",
        size: int | None = None,
        epochs: int | None = None,
        seed: int = 0,
        device: str = "auto",
    ) -> None:
        if peak not in ("subpixel", "argmax"):
            raise InputError(f"peak must be 'subpixel' or 'argmax', not {peak!r}")
        if preset not in PRESETS:
            raise InputError(f"preset must be one of {', '.join(PRESETS)}, not {preset!r}")
        if threshold is not None and not 0.0 <= threshold <= 1.0:
            raise InputError(f"threshold must be 0 to 1, but is {threshold:g}")
        for what, number, least, most in (("size", size, 32, 1024), ("epochs", epochs, 1, 100_000)):
            if number is not None and not least <= number <= most:
                raise InputError(f"{what} must be {least} to {most}, but is {number}")
        its_size, self.stages, its_training = PRESETS[preset]
        self.peak, self.threshold, self.size = peak, threshold, size or its_size
        self.training = replace(its_training, epochs=epochs or its_training.epochs, seed=seed)
        super().__init__(weights, device)

    @property
    def keypoints(self) -> int:
        """How many it has learned; 0 before."""
        return int(self._about.get("keypoints", 0))

    def fit(
        self,
        frames: Frames | npt.NDArray[np.uint8],
        keypoints: FloatArray | None = None,
        progress: Callable[[str, int, int], None] | None = None,
    ) -> None:
        """Learn from frames ``(N, H, W, 3)`` and their ``keypoints (N, K, 2)`` [px], NaN where one is not seen.

        Args:
            frames: of any size; they are shrunk to the working size.
            keypoints: K a frame, always the same spots in the same order.
            progress: told after every epoch: what, done, total.

        Raises:
            InputError: no annotation, one that does not fit the frames, or too few frames.
        """
        given = Frames.of(frames)
        points = _checked(given, keypoints)
        pictures = shrunk(given.rgb, self.size)
        points = moved(points, given.rgb.shape[1:3], pictures.shape[1:3])
        with torch.random.fork_rng():
            torch.manual_seed(self.training.seed)
            net = HeatmapNet(points.shape[1], self.stages)
            learned = train(net, pictures, points, self.training, self._device(), progress)
        self._learned(net, self._described(given, pictures.shape[1:3], points.shape[1], learned))

    def _described(self, given: Frames, shape: tuple[int, ...], count: int, learned: Learned) -> dict[str, Any]:
        scale = given.rgb.shape[2] / shape[1]
        return {
            "muslin": __version__,
            "keypoints": count,
            "stages": self.stages,
            "height": shape[0],
            "width": shape[1],
            "threshold": learned.threshold,
            "frames": len(given),
            "error_px": None if np.isnan(learned.error) else round(learned.error * scale, 3),
            "epochs": learned.epochs,
            "training": asdict(self.training),
        }

    def extract(self, source: PointSeries | Frames | npt.NDArray[np.uint8], time: FloatArray) -> PointSeries:
        """Keypoints ``(T, K, 2)`` [px of the frames]; NaN where the confidence is below the threshold.

        Frames of another size than those it learned from are scaled to the size of those.

        Raises:
            InputError: it has not learned yet, points instead of frames, or no keypoint is seen in any frame.
        """
        if isinstance(source, PointSeries):
            raise InputError("extractor 'heatmap' takes images, not points; give it a video")
        frames = Frames.of(source)
        points, sure = self.locate(frames)
        if sure.size and not (sure >= self.least).any():
            raise InputError(
                f"no keypoint reaches a confidence of {self.least:.2f} in any of {len(frames)} frames; the best has "
                f"{sure.max():.2f}. Train on frames like these, or lower the threshold"
            )
        points[sure < self.least] = np.nan
        return PointSeries(time, points, "px")

    def locate(self, frames: Frames) -> tuple[FloatArray, FloatArray]:
        """Every keypoint, seen or not ``(T, K, 2)`` [px], and its confidence ``(T, K)`` [1].

        Raises:
            InputError: it has not learned yet.
        """
        self._must_have_learned()
        given, shape = frames.rgb.shape[1:3], (int(self._about["height"]), int(self._about["width"]))
        device, net = self._device(), self._net
        parts = []
        for begin in range(0, len(frames), _BATCH):
            pictures = shrunk(frames.rgb[begin : begin + _BATCH], self.size, shape)
            parts.append(located(net, as_tensor(pictures).to(device), self.peak))
        points = np.concatenate([part[0] for part in parts])
        inside = np.clip(moved(points, shape, given), -0.5, np.array([given[1], given[0]]) - 0.5)
        return inside, np.concatenate([part[1] for part in parts])

    @property
    def least(self) -> float:
        """The confidence below which a keypoint is NaN [1]; after :meth:`fit`, or with weights."""
        return float(self._about["threshold"]) if self.threshold is None else self.threshold

    def _build(self) -> HeatmapNet:
        return HeatmapNet(self.keypoints, int(self._about["stages"]))


def _checked(frames: Frames, keypoints: FloatArray | None) -> FloatArray:
    """The annotation, if something can be learned from it."""
    if keypoints is None:
        raise InputError("extractor 'heatmap' learns from annotated frames; mark keypoints in some, or simulate them")
    points = np.asarray(keypoints, float)
    count, height, width = frames.rgb.shape[:3]
    if points.ndim != 3 or points.shape[0] != count or points.shape[2] != 2 or not points.shape[1]:
        raise InputError(f"{count} frames need keypoints of shape ({count}, K, 2), but they have {points.shape}")
    if count < FEWEST:
        raise InputError(f"'heatmap' learns from {FEWEST} annotated frames or more, but got {count}")
    seen = np.isfinite(points).all(axis=2)
    if not seen.any():
        raise InputError("no keypoint is annotated in any frame, so there is nothing to learn; mark some first")
    never = np.flatnonzero(~seen.any(axis=0))
    if len(never):
        raise InputError(
            f"keypoint {int(never[0])} (from 0) is annotated in no frame; mark it in some, or leave it out"
        )
    outside = seen & ~((points >= -0.5) & (points <= np.array([width, height]) - 0.5)).all(axis=2)
    if outside.any():
        frame, spot = np.argwhere(outside)[0]
        u, v = points[frame, spot]
        raise InputError(
            f"keypoint {spot} of frame {frame} (from 0) lies at ({u:g}, {v:g}), outside of a picture of {width} x "
            f"{height} pixels; give pixels of these frames, and NaN for a keypoint that is not seen"
        )
    points = points.copy()
    points[~seen] = np.nan
    return points
