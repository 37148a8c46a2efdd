"""Keypoints of a simulated mesh, without a picture: projected, and flawed as a detector's are."""

import hashlib
from typing import ClassVar, Literal

import numpy as np
import numpy.typing as npt

from ..core.arrays import BoolArray, FloatArray
from ..core.errors import InputError, RolloutFailed
from ..core.extractor import KeypointExtractor
from ..core.frames import Frames
from ..core.keypoints import keypoint_weights
from ..core.series import PointSeries
from ..core.simulated_take import SimulatedTake
from ..core.visibility import visible
from .flaws import flawed


class MeshExtractor(KeypointExtractor):
    """What a simulation may use instead of drawing pictures and finding points in them.

    Without noise, misses, shuffling and hiding it is the projection. The same take gets the same flaws, in whatever
    process it is seen.

    Args:
        points: which of a simulated take: its ``"markers"``, all ``"vertices"`` of the mesh, or ``"keypoints"``, see
            :func:`~muslin.core.keypoints.keypoint_weights`.
        count: of those keypoints.
        noise: standard deviation of every coordinate [px].
        missed: chance that a point in view is not found [1].
        permuted: shuffle the points of every frame, so that they have no correspondence.
        occluded: leave out what the object itself, an obstacle or the picture's edge hides.
        seed: of the flaws.

    Raises:
        InputError: an option that cannot be.
    """

    name: ClassVar[str] = "mesh"
    needs_images: ClassVar[bool] = False

    def __init__(
        self,
        points: Literal["markers", "vertices", "keypoints"] = "markers",
        count: int = 4,
        noise: float = 0.0,
        missed: float = 0.0,
        permuted: bool = False,
        occluded: bool = True,
        seed: int = 0,
    ) -> None:
        if points not in ("markers", "vertices", "keypoints"):
            raise InputError(f"points must be 'markers', 'vertices' or 'keypoints', not {points!r}")
        if count < 1:
            raise InputError(f"count must be 1 or more keypoints, but is {count}")
        if not 0.0 <= noise < np.inf:
            raise InputError(f"noise must be a standard deviation of 0 px or more, but is {noise:g}")
        if not 0.0 <= missed < 1.0:
            raise InputError(f"missed must be a chance of at least 0 and under 1, but is {missed:g}")
        if seed < 0:
            raise InputError(f"seed must be 0 or more, but is {seed}")
        self.points, self.count, self.seed = points, count, seed
        self.noise, self.missed, self.permuted, self.occluded = noise, missed, permuted, occluded

    def extract(self, source: PointSeries | Frames | npt.NDArray[np.uint8], time: FloatArray) -> PointSeries:
        """The points with noise, misses and shuffling; what hides them is not known here.

        Raises:
            InputError: frames instead of points, or noise where the points are in metres.
        """
        if not isinstance(source, PointSeries):
            raise InputError("extractor 'mesh' takes points, not images")
        if source.unit != "px" and self.noise:
            raise InputError("the noise of extractor 'mesh' is in pixels, but these points are in metres; set it to 0")
        return self._flawed(source, np.ones(source.points.shape[:2], bool), [source.points])

    def observe(self, take: SimulatedTake) -> PointSeries:
        """The take's points in pixels ``(T, P, 2)``.

        Raises:
            InputError: the take has no camera.
            RolloutFailed: no point is in view in any frame.
        """
        if take.camera is None:
            raise InputError(
                "extractor 'mesh' needs a camera to see a simulated take; import the recording with --camera FILE"
            )
        places = self._places(take)
        pixels = take.camera.project(places)[0]
        series = PointSeries(take.series.time, pixels, "px", self.points != "markers" or take.series.correspondence)
        seen = np.ones(places.shape[:2], bool)
        if self.occluded:
            seen = visible(take.scene, take.camera, take.vertices, places)
        return self._flawed(series, seen, [take.vertices, places])

    @property
    def uses_markers(self) -> bool:
        return self.points == "markers"

    def points_of(self, vertices: int, markers: int, measured: int) -> int:
        return {"markers": markers, "vertices": vertices, "keypoints": self.count}[self.points]

    def _places(self, take: SimulatedTake) -> FloatArray:
        """``(T, P, 3)`` [m]."""
        if self.points == "markers":
            return take.series.points
        if self.points == "vertices":
            return take.vertices
        return np.asarray(keypoint_weights(take.scene.body, self.count) @ take.vertices)

    def _flawed(self, series: PointSeries, seen: BoolArray, content: list[FloatArray]) -> PointSeries:
        digest = hashlib.blake2b(digest_size=16)
        for part in content:
            digest.update(np.ascontiguousarray(part, float).tobytes())
        rng = np.random.default_rng([self.seed, int.from_bytes(digest.digest(), "big")])
        points = flawed(series.points, seen, self.noise, self.missed, self.permuted, rng)
        if not np.isfinite(points).all(axis=2).any():
            raise RolloutFailed("the object is out of view: the camera sees no point of it in any frame")
        return PointSeries(series.time, points, series.unit, series.correspondence and not self.permuted)
