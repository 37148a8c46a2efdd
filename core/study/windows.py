"""Recordings in pieces that start as measured one after the other: multiple shooting."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..errors import InputError
from ..measurement import Recording

#: A piece has so many frames at least.
_FEWEST = 10


def cut_up(recording: Recording, length: float) -> list[Recording]:
    """``recording`` cut into pieces of about ``length`` [s], all of the same share of it.

    Small errors grow in what moves fast, until what a model does after seconds is left to chance, whatever its
    parameters; a piece ends before that. Each starts in the first frame that shows every point, from where its share
    begins.

    References:
        Bock, *Recent advances in parameter identification techniques for ODE*, 1983.

    Raises:
        InputError: a piece would have too few frames.
    """
    series = recording.series
    time = series.time - series.time[0]
    count = max(1, round(float(time[-1]) / length))
    seen = np.isfinite(series.points).all(axis=(1, 2))
    starts = []
    for k in range(count):
        found = np.flatnonzero(seen & (time >= k * time[-1] / count - 1e-9))
        if len(found) and found[0] not in starts:
            starts.append(int(found[0]))
    parts = list(pairwise([*starts, len(time)]))
    if not parts or min(end - start for start, end in parts) < _FEWEST:
        raise InputError(
            f"[study.window]: recording {recording.name!r} has pieces of fewer than {_FEWEST} frames in {length:g} s; "
            "choose longer ones, or start the recording where all points are seen"
        )
    return [
        replace(
            recording,
            name=f"{recording.name} from {time[a]:.3g} s",
            motion=f"{recording.motion} from {time[a]:.3g} s",
            series=replace(series, time=series.time[a:b], points=series.points[a:b]),
        )
        for a, b in parts
    ]
