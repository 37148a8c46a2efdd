"""Keypoint extractors: frames to point series."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from .arrays import FloatArray
from .errors import InputError, RolloutFailed
from .frames import Frames
from .series import PointSeries
from .simulated_take import SimulatedTake


class KeypointExtractor(ABC):
    """Turns what was recorded, or simulated, into the points that are compared.

    Extractors that learn override :meth:`fit`. NaN means that a point was not seen.
    """

    name: ClassVar[str]
    #: True if it needs images; then :meth:`extract` gets frames, else it gets points.
    needs_images: ClassVar[bool]
    #: True if a point that is not in a picture comes out as NaN.
    reports_unseen: ClassVar[bool] = False
    #: Options with which one that learns does so in seconds, however badly; the conformance kit takes them.
    quick: ClassVar[Mapping[str, object]] = {}

    def fit(
        self,
        frames: Frames | npt.NDArray[np.uint8],
        keypoints: FloatArray | None = None,
        progress: Callable[[str, int, int], None] | None = None,
    ) -> None:
        """Learn from ``frames (N, H, W, 3)``, and ``keypoints (N, K, 2)`` [px] where they are annotated.

        ``progress`` is told what is done, how much of it, and of how much.
        """
        return None

    @property
    def ready(self) -> bool:
        """Whether it can look: it need not learn, or has learned."""
        return True

    @abstractmethod
    def extract(self, source: PointSeries | Frames | npt.NDArray[np.uint8], time: FloatArray) -> PointSeries:
        """Points of ``source``: a point series, or frames ``(T, H, W, 3)`` at ``time (T,)`` [s]."""

    def observe(self, take: SimulatedTake) -> PointSeries:
        """Points of a simulated take, as they would have been found in a recording of it.

        By default those of its rendered frames, or of its markers, projected where the recording is in pixels.

        Raises:
            RolloutFailed: nothing is found in any frame of it.
        """
        if self.needs_images:
            frames = take.frames()
            try:
                return self.extract(frames, take.series.time)
            except InputError as error:
                raise RolloutFailed(f"nothing is found in its pictures: {error}") from error
        seen = take.series if take.camera is None or take.unit == "m" else take.projected()
        return self.extract(seen, seen.time)

    @property
    def uses_markers(self) -> bool:
        """Whether :meth:`observe` gives the markers of the scenario, which then must be those of the recording."""
        return not self.needs_images

    def points_of(self, vertices: int, markers: int, measured: int) -> int:
        """How many points :meth:`observe` gives.

        Args:
            vertices, markers: how many the simulated object has.
            measured: how many this extractor found in the recording.
        """
        return markers if self.uses_markers else measured
