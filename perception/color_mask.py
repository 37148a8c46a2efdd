"""Keypoints by colour: pixels of an object that is painted like nothing else in the picture."""

from collections.abc import Sequence
from typing import ClassVar, Literal

import numpy as np
import numpy.typing as npt

from ..core.arrays import BoolArray, FloatArray
from ..core.errors import InputError, RolloutFailed
from ..core.extractor import KeypointExtractor
from ..core.frames import Frames
from ..core.picture import Appearance, texture_of
from ..core.series import PointSeries
from ..core.simulated_take import SimulatedTake
from ..core.subsets import even_subset, outermost, stacked
from .colour import ColourRange, object_mask, told

#: The colour in which muslin's renderers paint an object.
_PAINTED = texture_of(Appearance().object)[0, 0].tolist()
#: What is told apart from a colour by hue [degrees].
TOLERANCE = 15.0


class ColorMaskExtractor(KeypointExtractor):
    """Pixels of one colour, as points without correspondence.

    Args:
        colour: of the object, ``"#c44832"`` or red green blue 0 to 255; default that of muslin's own pictures. Not
            beside ``hue``, ``saturation`` or ``value``.
        tolerance: of its hue [degrees].
        hue: from and to [degrees, 0 to 360]; through red where it ends below its beginning, as 340 to 20.
        saturation, value: least and most, 0 to 1.
        points: how many a frame; NaN where the object has fewer pixels.
        kind: ``"pixels"``, which cover the object evenly, or ``"outermost"``, which lie as far from each other as
            can be, as the corners of a cloth or the ends of a rope.
        speck: patches with fewer pixels than this are left out [px].

    Raises:
        InputError: a bound that cannot be.
    """

    name: ClassVar[str] = "color-mask"
    needs_images: ClassVar[bool] = True

    def __init__(
        self,
        colour: str | Sequence[int] | None = None,
        tolerance: float = TOLERANCE,
        hue: Sequence[float] | None = None,
        saturation: Sequence[float] | None = None,
        value: Sequence[float] | None = None,
        points: int = 64,
        kind: Literal["pixels", "outermost"] = "pixels",
        speck: int = 20,
    ) -> None:
        if points < 1:
            raise InputError(f"points must be 1 or more a frame, but is {points}")
        if kind not in ("pixels", "outermost"):
            raise InputError(f"kind must be 'pixels' or 'outermost', not {kind!r}")
        if speck < 0:
            raise InputError(f"speck must be 0 pixels or more, but is {speck}")
        self.range = colour_range(colour, tolerance, hue, saturation, value)
        self.points, self.kind, self.speck = points, kind, speck

    def extract(self, source: PointSeries | Frames | npt.NDArray[np.uint8], time: FloatArray) -> PointSeries:
        """Points ``(T, points, 2)`` [px] without correspondence; NaN in a frame without that colour.

        Raises:
            InputError: points instead of frames, or no frame that has the colour.
        """
        if isinstance(source, PointSeries):
            raise InputError("extractor 'color-mask' takes images, not points; give it a video")
        frames = Frames.of(source)
        masks = object_mask(frames.rgb, self.range, self.speck)
        if not masks.any():
            raise no_object(frames, self.range)
        return self._points(masks, time)

    def observe(self, take: SimulatedTake) -> PointSeries:
        """The object's pixels in rendered frames, of whatever colour it is drawn.

        Raises:
            InputError: the take has no camera.
            RolloutFailed: the object is out of view in every frame.
        """
        masks = take.masks()
        if not masks.any():
            raise RolloutFailed("the object is out of view: no frame shows it")
        return self._points(masks, take.series.time)

    def points_of(self, vertices: int, markers: int, measured: int) -> int:
        return self.points

    def _points(self, masks: BoolArray, time: FloatArray) -> PointSeries:
        found = []
        for mask in masks:
            pixels = np.argwhere(mask)[:, ::-1]
            if self.kind == "pixels":
                chosen = even_subset(pixels.astype(np.int64), self.points)
            else:
                chosen = outermost(pixels.astype(float), self.points)
            found.append(pixels[chosen].astype(float))
        return PointSeries(time, stacked(found, self.points), "px", correspondence=False)


def colour_range(
    colour: str | Sequence[int] | None = None,
    tolerance: float = TOLERANCE,
    hue: Sequence[float] | None = None,
    saturation: Sequence[float] | None = None,
    value: Sequence[float] | None = None,
) -> ColourRange:
    """The range of a colour, or of bounds; that of muslin's own pictures if neither is given."""
    bounds = {"hue": hue, "saturation": saturation, "value": value}
    given = {name: b for name, b in bounds.items() if b is not None}
    if given and colour is not None:
        raise InputError(f"give either a colour or {' and '.join(given)}, not both")
    if given:
        return ColourRange(**given)
    return ColourRange.around(_PAINTED if colour is None else colour, tolerance)


def no_object(frames: Frames, colour: ColourRange) -> InputError:
    """What to say where no frame shows the object."""
    return InputError(
        f"no frame has a patch with {colour}; the pictures are {told(frames.rgb)}. Name the object's own colour or "
        "widen the range"
    )
