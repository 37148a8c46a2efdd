"""Markers as keypoints: the identity."""

from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ..core.arrays import FloatArray
from ..core.errors import InputError
from ..core.extractor import KeypointExtractor
from ..core.frames import Frames
from ..core.series import PointSeries


class MarkerExtractor(KeypointExtractor):
    """Motion-capture markers are points already; they pass through unchanged."""

    name: ClassVar[str] = "markers"
    needs_images: ClassVar[bool] = False

    def extract(self, source: PointSeries | Frames | npt.NDArray[np.uint8], time: FloatArray) -> PointSeries:
        """The series itself; frames are an :class:`InputError`, markers cannot be found in images."""
        if not isinstance(source, PointSeries):
            raise InputError("extractor 'markers' takes measured points, not images")
        return source
