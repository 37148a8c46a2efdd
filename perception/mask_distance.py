"""The step ``mask-distance``: how far apart two sets of videos are, by the pixels of the object."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.arrays import FloatArray
from ..core.errors import InputError
from ..core.frames import Video
from .chamfer import mask_chamfer
from .color_mask import TOLERANCE, colour_range, no_object
from .colour import ColourRange, object_mask


@dataclass(frozen=True, eq=False)
class TakeDistance:
    """Of one pair of takes.

    Args:
        one, other: their names.
        time: of the frames that were compared ``(T,)`` [s].
        curve: distance over time ``(T,)`` [px].
        unseen: frames in which either shows nothing of the object; they count the picture's diagonal.
    """

    one: str
    other: str
    time: FloatArray
    curve: FloatArray
    unseen: int

    @property
    def mean(self) -> float:
        """Over time [px]."""
        return float(self.curve.mean())


@dataclass(frozen=True, eq=False)
class MaskDistance:
    """Distances of all pairs of takes."""

    takes: tuple[TakeDistance, ...]
    colour: ColourRange

    @property
    def mean(self) -> float:
        """Over the takes [px]."""
        return float(np.mean([t.mean for t in self.takes]))

    @property
    def deviation(self) -> float:
        """One standard deviation over the takes [px]; 0 of one take."""
        return float(np.std([t.mean for t in self.takes]))

    def text(self) -> str:
        """What a person reads."""
        lines = [f"object: {self.colour}"]
        for t in self.takes:
            unseen = f", {t.unseen} without the object" if t.unseen else ""
            lines.append(f"{t.one} to {t.other}: {t.mean:.2f} px over {len(t.time)} frames{unseen}")
        takes = f"{len(self.takes)} take{'s' if len(self.takes) > 1 else ''}"
        return "\n".join([*lines, f"distance of masks: {self.mean:.2f} ± {self.deviation:.2f} px over {takes}"])

    def to_json(self) -> dict[str, Any]:
        """Everything, the curves over time included."""
        takes = [
            {"one": t.one, "other": t.other, "mean_px": t.mean, "unseen": t.unseen}
            | {"time_s": t.time.tolist(), "distance_px": t.curve.tolist()}
            for t in self.takes
        ]
        return {"mean_px": self.mean, "sd_px": self.deviation, "takes": takes, "object": str(self.colour)}


def mask_distance(
    one: Sequence[Video],
    other: Sequence[Video],
    *,
    colour: str | Sequence[int] | None = None,
    tolerance: float = TOLERANCE,
    hue: Sequence[float] | None = None,
    saturation: Sequence[float] | None = None,
    value: Sequence[float] | None = None,
    speck: int = 20,
) -> MaskDistance:
    """Bidirectional Chamfer distance between the object's pixels, frame by frame.

    Takes of the same name are compared; a single take with each of the other side. The frames of the first that lie in
    the span of the second are held against the nearest in time.

    Args:
        one, other: videos of the same size.
        colour, tolerance, hue, saturation, value, speck: of the object, as of extractor ``color-mask``.

    Raises:
        InputError: takes that do not go together, or a video that never shows the object.
    """
    wanted = colour_range(colour, tolerance, hue, saturation, value)
    return MaskDistance(tuple(_compared(a, b, wanted, speck) for a, b in _pairs(one, other)), wanted)


def _pairs(one: Sequence[Video], other: Sequence[Video]) -> list[tuple[Video, Video]]:
    if len(one) == 1 or len(other) == 1:
        return [(a, b) for a in one for b in other]
    named = {v.name: v for v in other}
    pairs = [(v, named[v.name]) for v in one if v.name in named]
    if not pairs:
        names = [", ".join(v.name for v in side) for side in (one, other)]
        raise InputError(f"no take of one store has the name of one of the other: {names[0]}; {names[1]}")
    return pairs


def _compared(one: Video, other: Video, colour: ColourRange, speck: int) -> TakeDistance:
    if one.frames.rgb.shape[1:] != other.frames.rgb.shape[1:]:
        sizes = [f"{v.name!r} has {v.frames.rgb.shape[2]} x {v.frames.rgb.shape[1]}" for v in (one, other)]
        raise InputError(f"frames must have one size to be compared, but {sizes[0]} and {sizes[1]} pixels")
    rows = np.flatnonzero((one.time >= other.time[0] - 1e-9) & (one.time <= other.time[-1] + 1e-9))
    if not len(rows):
        spans = [f"{v.name!r} runs from {v.time[0]:g} to {v.time[-1]:g} s" for v in (one, other)]
        raise InputError(f"no frames are of the same time: {spans[0]}, {spans[1]}")
    nearest = np.abs(one.time[rows, None] - other.time).argmin(axis=1)
    masks = []
    for video, kept in ((one, rows), (other, nearest)):
        frames = video.frames[kept]
        found = object_mask(frames.rgb, colour, speck)
        if not found.any():
            raise InputError(f"video {video.name!r}: {no_object(frames, colour)}")
        masks.append(found)
    unseen = ~(masks[0].any(axis=(1, 2)) & masks[1].any(axis=(1, 2)))
    return TakeDistance(one.name, other.name, one.time[rows], mask_chamfer(*masks), int(unseen.sum()))
