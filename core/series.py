"""Point series: what is measured and what is compared, always."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .arrays import BoolArray, FloatArray
from .errors import InputError

PointUnit = Literal["m", "px"]


def seconds(time: float) -> str:
    """A time as it is told and can be given back, also of a clock that counts from 1970."""
    return f"{round(time, 4):.15g}"


@dataclass(frozen=True, eq=False)
class PointSeries:
    """Points over time, in metres or pixels.

    Args:
        time: ``(T,)`` [s], rising.
        points: ``(T, P, A)`` with A = 2 or 3; NaN where a point was not seen, or a coordinate not measured.
        unit: ``"m"`` or ``"px"``.
        correspondence: true if point p is the same spot of the object in every frame and series.
    """

    time: FloatArray
    points: FloatArray
    unit: PointUnit = "m"
    correspondence: bool = True

    def __post_init__(self) -> None:
        t, p = self.time, self.points
        if p.ndim != 3 or p.shape[2] not in (2, 3) or p.shape[1] == 0:
            raise InputError(f"points must have shape (T, P, 2) or (T, P, 3), but have {p.shape}")
        if t.shape != p.shape[:1]:
            raise InputError(f"time has shape {t.shape}, but points have {p.shape[0]} frames")
        if len(t) < 2:
            raise InputError(f"a series needs at least 2 frames, but has {len(t)}")
        if not np.isfinite(t).all():
            raise InputError(f"time[{int(np.argmin(np.isfinite(t)))}] is not a number")
        if not (np.diff(t) > 0).all():
            k = int(np.argmin(np.diff(t) > 0)) + 1
            raise InputError(
                f"time must rise, but time[{k}] = {t[k]:g} s follows time[{k - 1}] = {t[k - 1]:g} s; "
                "sort the frames or drop the repeated ones"
            )
        if float(np.median(np.diff(t))) > 5.0:
            raise InputError(
                f"frames are {float(np.median(np.diff(t))):g} s apart in the middle; time must be in seconds, "
                "is it in milliseconds?"
            )
        if self.unit not in ("m", "px"):
            raise InputError(f"unit must be 'm' or 'px', not {self.unit!r}")
        if not np.isfinite(p).any():
            raise InputError("every point is NaN in every frame; check the columns and the marker labels")
        if not self.correspondence and not self.valid.any():
            raise InputError(
                "no point has all its coordinates, which points without correspondence are compared by; "
                "a coordinate that was not measured may only be left out of points that keep their order"
            )

    @property
    def valid(self) -> BoolArray:
        """``(T, P)``: the point was seen, in every coordinate."""
        return np.asarray(np.isfinite(self.points).all(axis=2))

    @property
    def frames(self) -> int:
        return len(self.time)
