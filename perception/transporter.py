"""Keypoints without annotation: what must be carried from one picture to another to make it."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import ClassVar

import numpy as np
import numpy.typing as npt
import torch

from ..core.arrays import FloatArray
from ..core.errors import InputError
from ..core.frames import Frames
from ..core.series import PointSeries
from .learned import LearnedExtractor
from .transporter_net import Transporter
from .transporter_training import Training, as_tensor, shrunk, train

#: Frames that go through the network together.
_BATCH = 32


class TransporterExtractor(LearnedExtractor):
    """Transporter: keypoints learned from frames alone.

    A network encodes pictures as features, finds K places in them, and must make a target picture from the features of
    a source picture and those at the keypoints of the target; so keypoints go to what moves. The robot is left out of
    the loss where the frames have its mask, so that they go to the object.

    Args:
        weights: file that :meth:`save` wrote; empty: :meth:`fit` comes first. The keypoints and sizes are then the
            file's.
        keypoints: K.
        size: pixels of the longer edge of the working picture.
        steps, batch, window, focus, seed: of the training, see :class:`~.transporter_training.Training`; for a rope
            take a ``focus`` of about 3.
        confidence: a keypoint is NaN where less than this share of its heatmap lies around it.
        device: ``"auto"`` (a GPU where there is one), ``"cpu"`` or ``"cuda"``.

    Raises:
        InputError: an option that cannot be; MissingFileError: no such file of weights.

    References:
        Kulkarni et al., *Unsupervised Learning of Object Keypoints for Perception and Control*, 2019.
    """

    name: ClassVar[str] = "transporter"
    described: ClassVar[tuple[str, ...]] = ("keypoints", "size", "height", "width")
    quick: ClassVar[Mapping[str, object]] = {"steps": 10, "size": 32}

    def __init__(
        self,
        weights: str | Path = "",
        keypoints: int = 4,
        size: int = 80,
        steps: int = Training.steps,
        batch: int = Training.batch,
        window: int = Training.window,
        focus: float = Training.focus,
        confidence: float = 0.3,
        seed: int = 0,
        device: str = "auto",
    ) -> None:
        for what, number, least, most in (
            ("keypoints", keypoints, 1, 64),
            ("size", size, 32, 512),
            ("steps", steps, 1, 1_000_000),
            ("batch", batch, 2, 1024),
            ("window", window, 1, 1_000_000),
        ):
            if not least <= number <= most:
                raise InputError(f"{what} must be {least} to {most}, but is {number}")
        if not 0.0 <= focus <= 1e6:
            raise InputError(f"focus must be 0 or more, but is {focus:g}")
        if not 0.0 <= confidence <= 1.0:
            raise InputError(f"confidence must be 0 to 1, but is {confidence:g}")
        self.keypoints, self.size, self.confidence = keypoints, size, confidence
        self.training = Training(steps, batch, window, focus, seed=seed)
        self.losses: list[float] = []
        super().__init__(weights, device)
        if weights:
            self.keypoints, self.size = int(self._about["keypoints"]), int(self._about["size"])

    def fit(
        self,
        frames: Frames | npt.NDArray[np.uint8],
        keypoints: FloatArray | None = None,
        progress: Callable[[str, int, int], None] | None = None,
    ) -> None:
        """Learn from ``frames (N, H, W, 3)`` of one or more takes, one after the other, in the order of time.

        Args:
            frames: with the robot's mask, if there is a robot.
            keypoints: not needed, and not used.
            progress: told after every step: what, done, total.

        Raises:
            InputError: too few frames, or nothing moves.
        """
        given = Frames.of(frames)
        with torch.random.fork_rng():
            torch.manual_seed(self.training.seed)
            net = Transporter(self.keypoints)
            self.losses = train(net, given, self.size, self.training, self._device(), progress)
        height, width = given.rgb.shape[1:3]
        about = {"keypoints": self.keypoints, "size": self.size, "height": height, "width": width}
        self._learned(net, about | {"frames": len(given), "training": asdict(self.training)})

    def extract(self, source: PointSeries | Frames | npt.NDArray[np.uint8], time: FloatArray) -> PointSeries:
        """Keypoints ``(T, K, 2)`` [px of the frames]; NaN where the heatmap has no clear peak.

        Raises:
            StepMissingError: it has not learned yet.
            InputError: points instead of frames, frames of another shape, or no keypoint in any frame.
        """
        if isinstance(source, PointSeries):
            raise InputError("extractor 'transporter' takes images, not points; give it a video")
        frames = Frames.of(source)
        self._must_have_learned()
        height, width = frames.rgb.shape[1:3]
        learned = self._about["height"], self._about["width"]
        if abs(width * learned[0] / (height * learned[1]) - 1.0) > 0.02:
            raise InputError(
                f"'transporter' learned from frames of {learned[1]} x {learned[0]} pixels, but these have "
                f"{width} x {height}; give frames with the same ratio of width to height, or train on these"
            )
        places, sure = self._located(frames)
        points = 0.5 * (places + 1.0) * [width, height] - 0.5
        points[sure < self.confidence] = np.nan
        if not np.isfinite(points).any():
            raise InputError(
                f"no keypoint reaches a confidence of {self.confidence:g} in any of {len(frames)} frames; the best has "
                f"{sure.max():.2f}. Train on frames like these, or lower the confidence"
            )
        return PointSeries(time, points, "px")

    def _located(self, frames: Frames) -> tuple[FloatArray, FloatArray]:
        """Places ``(T, K, 2)`` from -1 to 1, and how sure they are ``(T, K)``."""
        device, net, found = self._device(), self._net, []
        with torch.no_grad():
            for begin in range(0, len(frames), _BATCH):
                pictures = as_tensor(shrunk(frames.rgb[begin : begin + _BATCH], self.size)).to(device)
                found.append([part.cpu().numpy().astype(float) for part in net.locate(pictures)])
        return np.concatenate([f[0] for f in found]), np.concatenate([f[1] for f in found])

    def _build(self) -> Transporter:
        return Transporter(self.keypoints)
