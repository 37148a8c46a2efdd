"""Whether a gripper clamps the end of a rope, or only holds it as a ring would, by how it leaves the gripper."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.arrays import FloatArray
from ..core.body import Body
from ..core.differences import rough_sd
from ..core.measurement import Recording
from ..core.motion import inverse, rotate
from ..core.scenario import STANDARD_GRAVITY
from ..core.scenarios import preset
from ..core.scenarios.laid import before_it_moves
from .study_plan import Plan

#: The outer of two markers is this many times as far from the gripper as the inner one at least, and the last within
#: this share of the rope: further out a rope that is swung is bent by its own inertia.
_APART, _WITHIN = 2.0, 0.3
#: The outer marker must swing by so many standard deviations of the noise.
_SHOWS = 5.0
#: If the inner marker swings by less than this share of what a rope that can turn has it swing by, the rope is clamped.
_TURNS = 0.85


def clamped(plan: Plan, recordings: Sequence[Recording], body: Body) -> tuple[Plan, list[str]]:
    """The plan with the first two vertices of a rope in the gripper that seemed to hold one, if it clamps it; a remark.

    A rope that hangs from a ring turns about it, so that a marker at twice the distance swings twice as far aside, but
    for how its own inertia bows it. One that is clamped leaves the gripper in one direction and bends beside it, so
    that near markers swing less.
    """
    if plan.kind != "rope" or plan.held != [[0]] or plan.grasps is not None or plan.grasp_points is not None:
        return plan, []
    if preset(plan.scenario).obstacles:  # what it touches bends it, too
        return plan, []
    places = np.concatenate([[0.0], np.cumsum(body.measures)])
    numbers = np.arange(len(places)) if plan.markers == "all" else plan.markers
    if isinstance(numbers, str) or numbers is None or plan.start is not None:
        return plan, []
    share = swing_near_the_gripper(recordings, places[np.asarray(numbers)], places[-1])
    if share is None or share >= _TURNS:
        return plan, []
    return replace(plan, grasps=[[0, 1]], held=[[0, 1]]), [
        f"the gripper clamps the rope: near it markers swing aside by {share:.2g} of what they would if it could turn "
        "there ([scenario] grasps; [[0]] lets it turn)"
    ]


def swing_near_the_gripper(recordings: Sequence[Recording], places: FloatArray, length: float) -> float | None:
    """By which share of what a rope that can turn has it a marker near the gripper swings aside; None if not known.

    Args:
        recordings: of a rope that one gripper holds at its beginning.
        places: of the markers along the rope ``(P,)`` [m], from the gripper.
        length: of the rope [m].
    """
    order = np.argsort(places)
    close = order[(places[order] > 0.0) & (places[order] <= _WITHIN * places.max())]
    if not len(close) or places[close[-1]] < _APART * places[close[0]]:
        return None
    inner, outer = int(close[0]), int(close[-1])
    aside: list[FloatArray] = []
    for recording in recordings:
        series, gripper = recording.series, recording.gripper
        if not series.correspondence or series.unit != "m" or gripper is None or gripper.grippers != 1:
            return None
        poses = gripper.at(series.time)[:, 0]
        start = before_it_moves(recording)[0]
        back = inverse(poses[:, 3:])
        near, far = (
            rotate(back, series.points[:, k] - poses[:, :3]) - rotate(back[0], start[k] - poses[0, :3])
            for k in (inner, outer)
        )
        velocity = np.gradient(poses[:, :3], series.time, axis=0)
        across = _across(np.gradient(velocity, series.time, axis=0), start[outer] - poses[0, :3])
        # of a rope that hangs T y' changes along it by mu a, and the tension T by -mu g: (L - s) y'' = a / g + y'
        bend = (rotate(back, across) / STANDARD_GRAVITY + far / places[outer]) / (length - places[outer] / 2)
        near = near + 0.5 * places[inner] * (places[outer] - places[inner]) * bend
        aside.append(np.stack([near, far, rotate(back, velocity)]))
    told = np.concatenate(aside, axis=1)
    one, other, along = told[:, np.isfinite(told).all(axis=(0, 2))]
    if not other.size or np.sqrt(np.mean(other**2)) <= _SHOWS * rough_sd(r.series.points for r in recordings):
        return None
    # a gripper or a clock that is late moves both markers by as much, along the velocity of the gripper
    slope = np.linalg.lstsq(np.stack([other.ravel(), along.ravel()], axis=1), one.ravel(), rcond=None)[0][0]
    return float(slope * places[outer] / places[inner])


def _across(vectors: FloatArray, direction: FloatArray) -> FloatArray:
    """What of ``vectors (T, 3)`` is at right angles to a direction."""
    unit = direction / np.linalg.norm(direction)
    return np.asarray(vectors - (vectors @ unit)[:, None] * unit)
