"""Whether takes of a rope show it from one gripper to the other, so that they can start through their markers."""

from collections.abc import Sequence

import numpy as np

from ..core.arrays import FloatArray
from ..core.measurement import Recording
from ..core.registry import REGISTRY
from ..core.scenarios.laid import before_it_moves, on_a_line
from .study_plan import Plan

#: Markers that tell the shape of a rope are so many at least, the outer ones as near to the grippers, over its length,
#: and the way from one to the next as long at most, over the shortest tree through them.
_FEWEST_MARKERS, _AT_THE_GRIPPER, _IN_ORDER = 6, 0.03, 1.3
#: A rope that sags by this share of its length sags down, in the mean over its takes, to so many degrees: one that
#: keeps a bend, or is swung, sags aside by far less.
_SAGS, _ASIDE = 0.05, 60.0
#: So many points on a line are those of a rope.
_FEWEST_OF_A_LINE = 4
#: A gripper holds the end of a line if it is no further beside it than this share of its length, nor from there inward.
_AT_AN_END = 0.05


def may_start_measured(plan: Plan) -> bool:
    """Whether the object is a rope between two grippers, and the simulator can start it in any shape, in motion."""
    if plan.kind != "rope" or plan.mesh is not None or plan.grasp_points is not None:
        return False
    return len(plan.held) == 2 and "start-velocity" in REGISTRY.get("simulator", plan.simulator).capabilities


def why_not_measured(recording: Recording, kept: list[int] | None) -> str | None:
    """Why a take cannot start through its markers, and what to do; nothing if these are not meant to; None if it can.

    It can where its first frame shows the rope from one gripper to the other, marker by marker. Then its length and its
    shape at the start are known, and need not be guessed by letting a rope of some length hang.
    """
    series, gripper = recording.series, recording.gripper
    if not series.correspondence or series.unit != "m" or gripper is None or gripper.grippers != 2:
        return ""
    numbers = list(range(series.points.shape[1])) if kept is None else kept
    first = series.points[0][numbers]
    if len(first) < _FEWEST_MARKERS or first.shape[1] != 3:
        return ""
    seen = np.isfinite(first).all(axis=1)
    if not seen.all():
        hidden = numbers[int(np.argmin(seen))]
        return (
            f"marker {hidden} is not seen in its first frame; import it from a later --start, leave the marker out "
            "with --points, or the take with --fit-on and --hold-out"
        )
    ends = gripper.at(series.time[:1])[0, :, :3]
    steps = np.linalg.norm(np.diff(first, axis=0), axis=1)
    near = np.linalg.norm(first[[0, -1]] - ends, axis=1) < _AT_THE_GRIPPER * steps.sum()
    # the shortest tree through markers in their order is the rope itself; numbered some other way they jump to and fro
    if near.all() and (steps > 0).all() and steps.sum() < _IN_ORDER * _shortest_tree(first):
        return None
    return "its markers do not lead from the first gripper to the second one by one; name those that do with --points"


def sags_aside(recordings: list[Recording]) -> list[str]:
    """A warning if ropes between two grippers sag, in the mean of all frames, along another axis than down."""
    sags, lengths = [], []
    for recording in recordings:
        points = recording.series.points
        straight = np.linspace(points[:, 0], points[:, -1], points.shape[1], axis=1)
        sags.append(np.nanmean(points - straight, axis=(0, 1)))
        lengths.append(float(np.linalg.norm(np.diff(points[0], axis=0), axis=1).sum()))
    sag = np.mean(sags, axis=0)
    depth = float(np.linalg.norm(sag))
    if depth < _SAGS * np.mean(lengths) or -sag[2] > depth * np.cos(np.radians(_ASIDE)):
        return []
    axis = int(np.argmax(np.abs(sag)))
    along = f"{'+' if sag[axis] > 0 else '-'}{'xyz'[axis]}"
    fix = f"import again with --up {'xyz'[axis]}" if axis < 2 and sag[axis] < 0 else "turn points and poses"
    return [f"warning: the rope sags by {depth:.2g} m along {along}, and z is taken to be up; {fix} if it is not"]


def _shortest_tree(points: FloatArray) -> float:
    """How long the shortest tree through ``points (P, 3)`` is [m], by Prim's algorithm."""
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    away, total = apart[0], 0.0
    left = np.arange(len(points)) > 0
    while left.any():
        nearest = int(np.argmin(np.where(left, away, np.inf)))
        total += away[nearest]
        left[nearest] = False
        away = np.minimum(away, apart[nearest])
    return float(total)


def rope_sizes(recordings: Sequence[Recording]) -> tuple[list[float], list[str]]:
    """The length of a rope, as ``--size`` would give it, where markers show one; a remark."""
    length = hanging_length(recordings)
    if length is None:
        return [], []
    return [length], [
        f"all points start on one line that begins in the gripper, as those of a rope do, {length:g} m from there to "
        "the last of them (--size LENGTH if it is longer)"
    ]


def hanging_length(recordings: Sequence[Recording]) -> float | None:
    """Length [m] of a rope, if markers start on one line in every take and a gripper holds an end of it; else None.

    From the gripper to the last marker, in the median over takes.
    """
    lengths = [_from_hand_to_tip(recording) for recording in recordings]
    told = [length for length in lengths if length is not None]
    return round(float(np.median(told)), 3) if len(told) == len(lengths) else None


def _from_hand_to_tip(recording: Recording) -> float | None:
    series = recording.series
    if not series.correspondence or series.unit != "m" or recording.gripper is None:
        return None
    first, _ = before_it_moves(recording)
    if not like_a_rope(first):
        return None
    seen = first[np.isfinite(first).all(axis=1)]
    hand = recording.gripper.at(series.time[:1])[0, 0, :3]
    along = np.linalg.svd(seen - seen.mean(axis=0), full_matrices=False)[2][0]
    places, held = (seen - hand) @ along, seen.mean(axis=0) - hand
    length = float(np.abs(places).max())
    beside = float(np.linalg.norm(held - (held @ along) * along))
    # on which side the rope is
    inward = -float((places * np.sign(np.median(places))).min())
    return length if max(beside, inward) <= _AT_AN_END * length else None


def like_a_rope(points: FloatArray) -> bool:
    """Whether those of ``points (P, 3)`` that are seen, four or more, lie on one line."""
    seen = points[np.isfinite(points).all(axis=1)]
    return len(seen) >= _FEWEST_OF_A_LINE and seen.shape[1] == 3 and on_a_line(seen)
