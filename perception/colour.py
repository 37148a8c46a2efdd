"""Colour ranges: which pixels of a picture belong to an object that has a colour of its own."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from ..core.arrays import BoolArray, FloatArray
from ..core.errors import InputError
from ..core.picture import Image

#: Below this saturation a colour has no hue to speak of [1].
GREY = 0.2
#: Hues by name, where each begins [degrees].
_NAMES = (
    ("red", 0),
    ("orange", 20),
    ("yellow", 45),
    ("green", 75),
    ("cyan", 160),
    ("blue", 200),
    ("purple", 265),
    ("pink", 310),
    ("red", 345),
)


@dataclass(frozen=True)
class ColourRange:
    """A box of hue, saturation and value.

    Args:
        hue: from and to [degrees, 0 to 360]; where it ends below its beginning it runs through red, as 340 to 20.
        saturation: least and most, 0 grey to 1 pure.
        value: least and most, 0 black to 1 bright.

    Raises:
        InputError: a bound is outside, or the least lies above the most.

    References:
        Smith, *Color gamut transform pairs*, SIGGRAPH 1978.
    """

    hue: Sequence[float] = (0.0, 360.0)
    saturation: Sequence[float] = (0.0, 1.0)
    value: Sequence[float] = (0.0, 1.0)

    def __post_init__(self) -> None:
        for what, most in (("hue", 360.0), ("saturation", 1.0), ("value", 1.0)):
            bounds = tuple(getattr(self, what))
            if len(bounds) != 2 or not all(0.0 <= b <= most for b in bounds):
                raise InputError(f"{what} must be two numbers from 0 to {most:g}, least and most, but is {bounds}")
            if what != "hue" and bounds[0] > bounds[1]:
                raise InputError(f"{what} runs from {bounds[0]:g} down to {bounds[1]:g}; the least comes first")
            object.__setattr__(self, what, (float(bounds[0]), float(bounds[1])))

    @classmethod
    def around(cls, colour: str | Sequence[int], tolerance: float) -> "ColourRange":
        """What a surface of one colour looks like in more and in less light.

        Hue within the tolerance, saturation and value from under half that of the colour upwards. Of a colour without
        hue: little saturation, and a value within a fifth.

        Args:
            colour: ``"#c44832"``, or red green blue 0 to 255.
            tolerance: of the hue [degrees], 0 to 180.
        """
        rgb = _parsed(colour)
        if not 0.0 < tolerance <= 180.0:
            raise InputError(f"tolerance must be above 0 and at most 180 degrees of hue, but is {tolerance:g}")
        hue, saturation, value = to_hsv(np.array(rgb, np.uint8)[None, None])[0, 0]
        if saturation < GREY or value < GREY:
            return cls((0.0, 360.0), (0.0, GREY + 0.1), (max(0.0, value - 0.2), min(1.0, value + 0.2)))
        ends = (0.0, 360.0) if tolerance == 180.0 else ((hue - tolerance) % 360.0, (hue + tolerance) % 360.0)
        return cls(ends, (0.45 * saturation, 1.0), (0.3 * value, 1.0))

    def mask(self, rgb: Image) -> BoolArray:
        """Which pixels of ``rgb (..., H, W, 3)`` are inside ``(..., H, W)``."""
        frames = rgb.reshape(-1, *rgb.shape[-3:])
        return np.stack([self._one(frame) for frame in frames]).reshape(rgb.shape[:-1])

    def _one(self, frame: Image) -> BoolArray:
        hue, saturation, value = np.moveaxis(to_hsv(frame), -1, 0)
        low, high = self.hue
        inside = (hue >= low) & (hue <= high) if low <= high else (hue >= low) | (hue <= high)
        inside &= (saturation >= self.saturation[0]) & (saturation <= self.saturation[1])
        return np.asarray(inside & (value >= self.value[0]) & (value <= self.value[1]))

    def __str__(self) -> str:
        parts = [f"hue {self.hue[0]:.0f} to {self.hue[1]:.0f} degrees"]
        for what in ("saturation", "value"):
            low, high = getattr(self, what)
            parts.append(f"{what} {low:.2f} to {high:.2f}")
        return ", ".join(parts)


def object_mask(rgb: Image, colour: ColourRange, speck: int = 20) -> BoolArray:
    """Pixels of that colour ``(T, H, W)`` in ``rgb (T, H, W, 3)``, without connected patches under ``speck`` pixels.

    Args:
        rgb: pictures.
        colour: of the object.
        speck: the smallest patch that is kept [px]; pixels that touch at a corner are of one patch.
    """
    if speck < 0:
        raise InputError(f"speck must be 0 pixels or more, but is {speck}")
    found = colour.mask(rgb)
    for mask in found:
        count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
        small = np.asarray(stats)[:count, cv2.CC_STAT_AREA] < speck
        small[0] = False
        if small.any():
            mask[small[labels]] = False
    return found


def told(rgb: Image) -> str:
    """The colours in pictures ``(T, H, W, 3)``, most frequent first, as ``"grey 81%, red 19%"``."""
    hsv = to_hsv(np.ascontiguousarray(rgb[:: max(1, len(rgb) // 8)].reshape(-1, rgb.shape[2], 3)))
    hue, saturation, value = (hsv[..., k].ravel() for k in range(3))
    which = np.searchsorted([begin for _, begin in _NAMES], hue, side="right") - 1
    names = np.array([name for name, _ in _NAMES])[which]
    names = np.where(saturation >= GREY, names, np.where(value > 0.85, "white", "grey"))
    names = np.where(value < GREY, "black", names)
    found, counts = np.unique(names, return_counts=True)
    order = np.argsort(-counts)
    shares = [(str(found[k]), counts[k] / counts.sum()) for k in order]
    return ", ".join(f"{name} {share:.0%}" for name, share in shares if share >= 0.005)


def to_hsv(rgb: Image) -> FloatArray:
    """Hue [degrees], saturation and value [1] ``(H, W, 3)`` of ``rgb (H, W, 3)``."""
    return np.asarray(cv2.cvtColor(rgb.astype(np.float32) / np.float32(255.0), cv2.COLOR_RGB2HSV))


def _parsed(colour: str | Sequence[int]) -> tuple[int, int, int]:
    try:
        red, green, blue = bytes.fromhex(colour.removeprefix("#")) if isinstance(colour, str) else bytes(colour)
    except (TypeError, ValueError) as error:
        raise InputError(f"a colour is written '#c44832', or three whole numbers 0 to 255, not {colour!r}") from error
    return red, green, blue
