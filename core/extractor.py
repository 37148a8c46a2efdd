"""Keypoint extractors: frames to point series."""

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from .arrays import FloatArray
from .series import PointSeries


class KeypointExtractor(ABC):
    """Turns what was recorded, or simulated, into the points that are compared.

    Extractors that learn override :meth:`fit`. NaN means that a point was not seen.
    """

    name: ClassVar[str]
    #: True if it needs images; then :meth:`extract` gets frames, else it gets points.
    needs_images: ClassVar[bool]

    def fit(self, frames: npt.NDArray[np.uint8], keypoints: FloatArray) -> None:
        """Learn from annotated ``frames (N, H, W, 3)`` with ``keypoints (N, K, 2)`` [px]."""
        return None

    @abstractmethod
    def extract(self, source: PointSeries | npt.NDArray[np.uint8], time: FloatArray) -> PointSeries:
        """Points of ``source``: a point series, or frames ``(T, H, W, 3)`` at ``time (T,)`` [s]."""
