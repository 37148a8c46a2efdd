"""Point clouds: the visible surface of the object, from depth or from a simulated mesh."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ..core.arrays import BoolArray, FloatArray
from ..core.errors import InputError, RolloutFailed
from ..core.extractor import KeypointExtractor
from ..core.frames import Frames
from ..core.series import PointSeries
from ..core.simulated_take import SimulatedTake
from ..core.subsets import stacked, thinned
from ..core.surface import object_surface
from ..core.surface_samples import spread_over
from ..core.visibility import visible
from .color_mask import TOLERANCE, colour_range, no_object
from .colour import object_mask

#: Candidates on a simulated surface for every point that is wanted.
_CANDIDATES = 4
#: Cosine to the line of sight below which a surface covers next to no pixels.
_GRAZING = 0.1


class CloudExtractor(KeypointExtractor):
    """Points on the visible surface in metres, in the world's frame, without correspondence.

    The object is what has its colour, or what lies in a box, or both.

    Args:
        colour, tolerance, hue, saturation, value, speck: of the object, as of ``color-mask``.
        box: low and high corner in the world, ``[[x, y, z], [x, y, z]]`` [m]; with it alone no colour is asked for.
        points: how many a frame; NaN where fewer are seen.
        voxel: points this near to each other count once, so that what is close to the camera has no more of them [m].

    Raises:
        InputError: an option that cannot be.
    """

    name: ClassVar[str] = "cloud"
    needs_images: ClassVar[bool] = True

    def __init__(
        self,
        colour: str | Sequence[int] | None = None,
        tolerance: float = TOLERANCE,
        hue: Sequence[float] | None = None,
        saturation: Sequence[float] | None = None,
        value: Sequence[float] | None = None,
        speck: int = 20,
        box: Sequence[Sequence[float]] | None = None,
        points: int = 128,
        voxel: float = 0.005,
    ) -> None:
        if points < 1:
            raise InputError(f"points must be 1 or more a frame, but is {points}")
        if not 1e-5 <= voxel <= 1.0:
            raise InputError(f"voxel must be 0.00001 to 1 m, but is {voxel:g}")
        if speck < 0:
            raise InputError(f"speck must be 0 pixels or more, but is {speck}")
        self.box = None if box is None else _checked(box)
        of_colour = any(option is not None for option in (colour, hue, saturation, value))
        asked = of_colour or box is None
        self.range = colour_range(colour, tolerance, hue, saturation, value) if asked else None
        self.points, self.voxel, self.speck = points, voxel, speck

    def extract(self, source: PointSeries | Frames | npt.NDArray[np.uint8], time: FloatArray) -> PointSeries:
        """Points ``(T, points, 3)`` [m]; pixels without depth are left out.

        Raises:
            InputError: no depth, no camera, no such colour, or no depth on the object.
        """
        if isinstance(source, PointSeries):
            raise InputError("extractor 'cloud' takes images with depth, not points; give it a video")
        frames = Frames.of(source)
        if frames.depth is None:
            raise InputError("extractor 'cloud' needs depth, which these frames have not; import the depth images, too")
        if frames.camera is None:
            raise InputError("extractor 'cloud' needs the camera of the frames; import the video with --camera FILE")
        kept = np.isfinite(frames.depth) & (frames.depth > 0)
        if self.range is not None:
            shown = object_mask(frames.rgb, self.range, self.speck)
            if not shown.any():
                raise no_object(frames, self.range)
            kept &= shown
        eye, rays = frames.camera.pose[:3], frames.camera.rays
        found = []
        for depth, mask in zip(frames.depth, kept, strict=True):
            places = eye + depth[mask].astype(float)[:, None] * rays[mask]
            if self.box is not None:
                places = places[((places >= self.box[0]) & (places <= self.box[1])).all(axis=1)]
            found.append(thinned(places, self.voxel, self.points))
        if not any(map(len, found)):
            where = "" if self.box is None else f" in the box from {self.box[0].tolist()} to {self.box[1].tolist()} m"
            raise InputError(f"no pixel of the object has depth{where}; check the depth images, the camera and the box")
        return PointSeries(time, stacked(found, self.points), correspondence=False)

    def observe(self, take: SimulatedTake) -> PointSeries:
        """Samples of the surface ``(T, points, 3)`` [m] that the camera sees; nothing is drawn for it.

        Raises:
            InputError: the take has no camera.
            RolloutFailed: nothing of the object is in view in any frame.
        """
        if take.camera is None:
            raise InputError(
                "extractor 'cloud' needs a camera to see a simulated take; import the recording with --camera FILE"
            )
        samples, facing = self._samples(take, take.camera.pose[:3])
        seen = visible(take.scene, take.camera, take.vertices, samples) & facing
        found = [thinned(places[row], self.voxel, self.points) for places, row in zip(samples, seen, strict=True)]
        if not any(map(len, found)):
            raise RolloutFailed("the object is out of view: the camera sees no point of it in any frame")
        return PointSeries(take.series.time, stacked(found, self.points), correspondence=False)

    def points_of(self, vertices: int, markers: int, measured: int) -> int:
        return self.points

    def _samples(self, take: SimulatedTake, eye: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Points ``(T, N, 3)`` [m] spread over the surface by its area, and which face ``eye (3,)`` ``(T, N)``."""
        surface = object_surface(take.scene)
        count = _CANDIDATES * self.points
        triangles = surface.triangles
        if take.scene.body.kind == "cloth":  # its two sides are one and the same
            triangles, count = triangles[: len(triangles) // 2], count // 2
        rest = surface.place(take.scene.body.vertices)[triangles]
        which, a, b = spread_over(rest, count)
        samples, facing = [], []
        for vertices in take.vertices:
            corners = surface.place(vertices)[triangles[which]]
            along, up = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
            spots = corners[:, 0] + a[:, None] * along + b[:, None] * up
            normal, ray = np.cross(along, up), eye - spots
            size = np.linalg.norm(normal, axis=1) * np.linalg.norm(ray, axis=1)
            slant = np.einsum("nx,nx->n", normal, ray) / np.where(size > 0, size, 1.0)
            samples.append(spots)
            facing.append((np.abs(slant) if take.scene.body.kind == "cloth" else slant) > _GRAZING)
        return np.stack(samples), np.stack(facing)


def _checked(box: Sequence[Sequence[float]]) -> FloatArray:
    try:
        corners = np.asarray(box, float)
    except (TypeError, ValueError):
        corners = np.zeros(0)
    if corners.shape != (2, 3) or not np.isfinite(corners).all() or not (corners[0] < corners[1]).all():
        raise InputError(f"box must be its low and its high corner, [[x, y, z], [x, y, z]] in m, but is {box}")
    return corners
