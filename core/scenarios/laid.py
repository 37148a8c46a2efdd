"""Where an object starts, told by its markers alone."""

from dataclasses import replace

import numpy as np

from ..arrays import FloatArray
from ..errors import InputError
from ..measurement import Recording, check_spatial
from ..motion import inverse, rotate
from ..scenario import Scenario
from .bent_sheet import BentSheet

#: Grippers that are within this of where they started have not moved [m].
_STILL = 1e-3
#: Points are on a line if they spread beside it by less than this share of what they do along it.
_LINE = 0.02
#: A sheet is bent as it starts if its markers are off a flat one by this share of their spread, root mean square.
_BENT = 0.03


def laid_under(scenario: Scenario, recording: Recording) -> Scenario:
    """The scenario with its object moved to where the markers are before a gripper moves, and bent if they are.

    So where a gripper holds the object follows from where both are, whatever point of it its pose is that of.

    Args:
        scenario: of an object that starts in its rest shape.
        recording: that it is of.

    Raises:
        InputError: the points are no markers in space, three that are not on a line are not seen at first, or the
            object starts in another shape.
    """
    check_spatial(recording)
    told = f"[scenario] frame = 'markers' cannot be for recording {recording.name!r}:"
    if not recording.series.correspondence:
        raise InputError(f"{told} its points are not followed, so nothing says which is where on the object")
    if scenario.start is not None:
        raise InputError(
            f"{told} in {scenario.name!r} the object does not start in its rest shape, but in one that follows from "
            "the grippers; leave frame out"
        )
    if len(scenario.markers) != recording.series.points.shape[1]:
        raise InputError(f"{told} its points are found in pictures, and sit nowhere on the object; take another frame")
    first, _ = before_it_moves(recording)
    seen = np.asarray(np.isfinite(first).all(axis=1))
    at_rest = scenario.world_vertices()
    places = scenario.markers @ at_rest
    if seen.sum() < 3 or on_a_line(places[seen]) or on_a_line(first[seen]):
        raise InputError(
            f"{told} {int(seen.sum())} of {len(seen)} markers are seen before a gripper moves, and it takes three "
            "that are not on one line; import from a later --start, or take another frame"
        )
    turn, shift = rigid(places[seen], first[seen])
    moved = at_rest @ turn.T + shift
    pose = scenario.motion.at(scenario.times[:1])[0, 0]
    local = rotate(inverse(pose[3:]), moved - pose[:3])
    laid = replace(scenario, body=replace(scenario.body, vertices=local))
    flat = (places @ turn.T + shift)[seen]
    spread = first[seen] - first[seen].mean(axis=0)
    if np.mean((first[seen] - flat) ** 2) <= _BENT**2 * np.mean(spread**2):
        return laid
    flat, bent = (rotate(inverse(pose[3:]), x - pose[:3]) for x in (flat, first[seen]))
    about = local[laid.grasps[0]].mean(axis=0) if laid.grasps else local.mean(axis=0)
    return replace(laid, start=BentSheet.through(flat, bent, float(laid.body.measures.sum()), about))


def before_it_moves(recording: Recording) -> tuple[FloatArray, int]:
    """Points ``(P, A)`` in the mean of all frames before a gripper moves, and how many these are.

    That is the first one where no gripper was recorded, which may show an object that falls.
    """
    series, count = recording.series, 1
    if recording.gripper is not None:
        places = recording.gripper.at(series.time)[:, :, :3]
        moved = np.linalg.norm(places - places[0], axis=2).max(axis=1) > _STILL
        count = int(np.argmax(moved)) if moved.any() else len(moved)
    frames = series.points[:count]
    seen = np.isfinite(frames)
    total = np.where(seen, frames, 0.0).sum(axis=0)
    return np.where(seen.any(axis=0), total / np.maximum(seen.sum(axis=0), 1), np.nan), count


def rigid(places: FloatArray, seen: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotation ``(3, 3)`` and shift ``(3,)`` that take ``places (N, 3)`` nearest to ``seen (N, 3)``.

    By least squares, see Kabsch, *A solution for the best rotation to relate two sets of vectors*, 1976.
    """
    one, other = places.mean(axis=0), seen.mean(axis=0)
    left, _, right = np.linalg.svd((seen - other).T @ (places - one))
    turn = left @ np.diag([1.0, 1.0, np.linalg.det(left) * np.linalg.det(right)]) @ right
    return turn, other - turn @ one


def on_a_line(points: FloatArray) -> bool:
    """Whether ``points (P, 3)`` lie on one line, but for noise."""
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(sizes[1] < _LINE * sizes[0])
