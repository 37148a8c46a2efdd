"""Length units of imported files."""

import numpy as np

from ..arrays import FloatArray
from ..errors import InputError
from ..series import PointUnit

#: Unit -> metres; pixels stay pixels.
METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}

_SPELLINGS = {
    "m": ("m", "meter", "meters", "metre", "metres"),
    "cm": ("cm", "centimeter", "centimeters", "centimetre", "centimetres"),
    "mm": ("mm", "millimeter", "millimeters", "millimetre", "millimetres"),
    "px": ("px", "pixel", "pixels"),
}

#: No object and no room of this library is larger [m]; numbers beyond are another unit.
LARGEST_SPAN = 50.0


def unit_named(text: str, where: str) -> str:
    """The unit that ``text`` spells, as ``"m"``, ``"cm"``, ``"mm"`` or ``"px"``.

    Raises:
        InputError: none of them; the message lists them.
    """
    for unit, spellings in _SPELLINGS.items():
        if text.strip().lower() in spellings:
            return unit
    raise InputError(f"{where}: unit {text!r} is not known; units are {', '.join(_SPELLINGS)}; say which with --unit")


def to_si(points: FloatArray, unit: str, where: str) -> tuple[FloatArray, PointUnit]:
    """Points in metres, or in pixels if that is what they are, with their unit.

    Args:
        points: ``(T, P, A)`` [unit].
        unit: from :func:`unit_named`.
        where: the file, for messages.

    Raises:
        InputError: pixels with three axes, or metres that span more than :data:`LARGEST_SPAN`.
    """
    if unit == "px":
        if points.shape[2] != 2:
            raise InputError(f"{where}: pixels have 2 coordinates (x, y), but the points have {points.shape[2]}")
        return points, "px"
    metres = points * METRES[unit]
    seen = metres[np.isfinite(metres).all(axis=2)]
    span = float(np.max(np.ptp(seen, axis=0))) if len(seen) else 0.0
    if span > LARGEST_SPAN:
        smaller = {"m": "mm", "cm": "mm"}.get(unit)
        advice = f"if the file is in millimetres, say --unit {smaller}" if smaller else "check the columns"
        if points.shape[2] == 2:
            advice += "; if it is in pixels, say --unit px"
        raise InputError(f"{where}: the points span {span:.4g} m when read in {unit}; {advice}")
    return metres, "m"
