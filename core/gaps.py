"""What stands for a point of a simulation that was not found in its pictures.

A measurement keeps its gaps: what was not seen is not compared. In a simulation a gap would have to count for something
in every comparison with a point that was seen, and the object does not vanish because a detector missed it. So it is
bridged.
"""

from dataclasses import replace

import numpy as np

from .arrays import BoolArray, FloatArray
from .errors import RolloutFailed
from .interpolation import interpolate
from .series import PointSeries


def bridged(series: PointSeries, compared: BoolArray | None = None) -> PointSeries:
    """The same points with a place in every frame.

    A point with correspondence moves evenly from where it was last found to where it is found next, and rests before
    and after. Without correspondence the points of a frame are doubled where some are missing, which leaves the set as
    it is, and a frame without any has those of the frame nearest in time.

    Args:
        series: of a simulation, NaN where not found.
        compared: the points ``(P,)`` that the measurement has; default all. With correspondence one of the others may
            never be found and is put in the middle of those that are.

    Raises:
        RolloutFailed: a point that is compared is found in no frame.
    """
    seen = series.valid
    if seen.all():
        return series
    points = np.array(series.points)
    if series.correspondence:
        _in_time(series, points, seen, np.ones(seen.shape[1], bool) if compared is None else compared)
    else:
        _in_frame(series.time, points, seen)
    return replace(series, points=points)


def _in_time(series: PointSeries, points: FloatArray, seen: BoolArray, compared: BoolArray) -> None:
    for k in np.flatnonzero(~seen.all(axis=0)):
        known = seen[:, k]
        if known.any():
            points[:, k] = interpolate(series.time, series.time[known], points[known, k])
        elif compared[k]:
            raise RolloutFailed(f"point {k} (from 0) of the recording is found in none of {len(known)} frames of it")
        else:
            points[:, k] = series.points[seen].mean(axis=0)


def _in_frame(time: FloatArray, points: FloatArray, seen: BoolArray) -> None:
    shown = np.flatnonzero(seen.any(axis=1))
    for t in np.flatnonzero(~seen.all(axis=1)):
        near = shown[np.abs(time[shown] - time[t]).argmin()]
        found = points[near, seen[near]]
        wanting = ~seen[t] if near == t else np.ones(seen.shape[1], bool)
        points[t, wanting] = np.resize(found, (int(wanting.sum()), found.shape[1]))
