"""Whether a cloth's one gripper holds what the scenario says, by what stays where it is in the hand."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.arrays import FloatArray
from ..core.differences import rough_sd
from ..core.measurement import Recording
from ..core.motion import inverse, rotate
from ..core.study import Problem
from .study_plan import Plan

#: A marker tells of vertices that are no further from it than this share of the cloth's size.
_NEAR = 0.15
#: It stays in the hand if it moves there by less than this share of what markers do in the median, …
_STAYS = 0.4
#: … which tells something if it is so many standard deviations of the noise.
_SHOWS = 5.0


def held_as_seen(plan: Plan, problem: Problem) -> tuple[Plan, list[str]]:
    """The plan with only those of the scenario's held vertices that stay in the hand; a remark.

    If none does it is the one that is nearest to the hand of those beside a marker that does. Nothing changes where a
    person says what is held, where nothing swings or stays, or a held vertex has no marker near it.
    """
    if plan.kind != "cloth" or len(plan.held) != 1 or plan.grasps is not None or plan.grasp_points is not None:
        return plan, []
    scenario = problem.scenarios[problem.fit_on[0]]
    recordings = [problem.recordings[name] for name in problem.fit_on]
    if any(r.series.points.shape[1:] != (len(scenario.markers), 3) for r in recordings):
        return plan, []
    moves = moving_in_the_hand(recordings)
    if moves is None or not (stays := moves < _STAYS * np.nanmedian(moves)).any():
        return plan, []
    vertices = scenario.body.vertices
    apart = np.linalg.norm(vertices[:, None] - scenario.markers @ vertices, axis=2)
    near = apart <= _NEAR * np.ptp(vertices, axis=0).max()
    held = [v for v in plan.held[0] if (near[v] & stays).any()]
    if len(held) == len(plan.held[0]) or not near[plan.held[0]].any(axis=1).all():
        return plan, []
    if not held:
        away = np.linalg.norm(scenario.start_vertices() - _hand(recordings[0])[0, :3], axis=1)
        held = [int(np.argmin(np.where((near & stays).any(axis=1), away, np.inf)))]
    told = ", ".join(str(v) for v in held)
    return replace(plan, grasps=[held], held=[held]), [
        f"the gripper holds {'vertex' if len(held) == 1 else 'vertices'} {told}: what else it holds in "
        f"{plan.scenario!r} does not stay where it is in the hand ([scenario] grasps)"
    ]


def moving_in_the_hand(recordings: Sequence[Recording]) -> FloatArray | None:
    """By how much each marker moves as the one gripper sees it, root mean square ``(P,)`` [m]; NaN if a take lacks it.

    What goes with the velocity of the gripper is taken off: its clock may be late. None if nothing is known of it, or
    most markers move by no more than noise makes them.
    """
    squares = []
    for recording in recordings:
        series, gripper = recording.series, recording.gripper
        if not series.correspondence or series.unit != "m" or gripper is None or gripper.grippers != 1:
            return None
        poses = _hand(recording)
        back = inverse(poses[:, None, 3:])
        there = rotate(back, series.points - poses[:, None, :3])
        velocity = rotate(back, np.gradient(poses[:, :3], series.time, axis=0)[:, None])
        seen = np.isfinite(there).all(axis=2, keepdims=True)
        frames = seen.sum(axis=0)[:, 0]
        count = np.maximum(frames, 1)[:, None]
        there, along = (np.where(seen, x - np.where(seen, x, 0.0).sum(axis=0) / count, 0.0) for x in (there, velocity))
        slope = np.sum(there * along, axis=(0, 2)) / np.maximum(np.sum(along**2, axis=(0, 2)), 1e-12)
        square = np.sum((there - slope[:, None] * along) ** 2, axis=(0, 2)) / (3 * count[:, 0])
        squares.append(np.where(frames > 0, square, np.nan))
    moves = np.asarray(np.sqrt(np.mean(squares, axis=0)))
    known = moves[np.isfinite(moves)]
    if not len(known) or np.median(known) <= _SHOWS * rough_sd(r.series.points for r in recordings):
        return None
    return moves


def _hand(recording: Recording) -> FloatArray:
    """Poses of the gripper at the frames ``(T, 7)``."""
    assert recording.gripper is not None
    return recording.gripper.at(recording.series.time)[:, 0]
