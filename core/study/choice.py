"""Which of many takes are fitted, and which are held out, where nobody says."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from ..measurement import Recording

#: So many motions are fitted, and held out: a fit of more takes long and tells little more, and what was fitted checks
#: nothing.
FITTED, HELD_OUT = 5, 4
#: Frames that tell how fast a take starts.
_FRAMES = 6
Thing = TypeVar("Thing")


def chosen(recordings: Sequence[Recording]) -> tuple[list[str], list[str]]:
    """Names of what is fitted, and of what is held out: of fewer than three motions all and none.

    Motions are ordered from that which starts slowest to that which starts fastest, and what is held out lies between
    what is fitted: the middle one of every three, or, of more motions than a fit needs, every second of some that are
    spread evenly. All takes of a motion go together: a repeat of what was fitted checks nothing. Of many motions those
    that are not seen at the start come last, and are left out where enough others are.
    """
    count = FITTED + HELD_OUT
    motions: dict[str, list[Recording]] = {}
    for recording in recordings:
        motions.setdefault(recording.motion, []).append(recording)
    speeds = {name: max(start_speed(r) for r in takes) for name, takes in motions.items()}
    ordered = sorted(motions, key=speeds.__getitem__)
    if len(motions) > count:
        seen = [name for name in ordered if np.isfinite(speeds[name])]
        used = spread(seen if len(seen) >= count else ordered, count)
        held = used[1::2]
    else:
        used, held = list(motions), [ordered[3 * k + 1] for k in range(len(ordered) // 3)]
    fitted = [name for name in used if name not in held]
    return [r.name for name in fitted for r in motions[name]], [r.name for name in held for r in motions[name]]


def start_speed(recording: Recording) -> float:
    """How fast the fastest point is at the start [m/s or px/s], infinite where one is not seen.

    Points that nothing tells apart, and those that were found in pictures, are as fast as their middle.
    """
    series = recording.series
    points, time = series.points[:_FRAMES], series.time[:_FRAMES]
    if not series.correspondence or series.unit == "px":
        seen = np.isfinite(points).all(axis=2, keepdims=True)
        known = seen.sum(axis=1, keepdims=True)
        points = np.where(seen, points, 0.0).sum(axis=1, keepdims=True) / np.where(known > 0, known, np.nan)
    speed = np.linalg.norm(np.diff(points, axis=0), axis=2).max(axis=1) / np.diff(time)
    return float(np.median(speed)) if np.isfinite(speed).all() else float("inf")


def spread(things: Sequence[Thing], count: int) -> list[Thing]:
    """The middle one of each of ``count`` parts of ``things`` that are as long as one another; of fewer, all."""
    count = min(count, len(things))
    return [things[int((k + 0.5) * len(things) / count)] for k in range(count)]
