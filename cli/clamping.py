"""Whether a gripper clamps the end of a rope, or only holds it as a ring would, by how it leaves the gripper."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.arrays import FloatArray
from ..core.body import Body
from ..core.differences import fourth_differences, robust_sd
from ..core.measurement import Recording
from ..core.motion import inverse, rotate
from ..core.scenarios import preset
from ..core.scenarios.laid import before_it_moves
from .study_plan import Plan

#: The outer of two markers is this many times as far from the gripper as the inner one at least, and the last within
#: this share of the rope: further out a rope that is swung is bent by its own inertia.
_APART, _WITHIN = 2.0, 0.3
#: The outer marker must swing by so many standard deviations of the noise.
_SHOWS = 5.0
#: If the inner marker swings by less than this share of what a straight rope has it swing by, the rope is clamped.
_STRAIGHT = 0.65


def clamped(plan: Plan, recordings: Sequence[Recording], body: Body) -> tuple[Plan, list[str]]:
    """The plan with the first two vertices of a rope in the gripper that seemed to hold one, if it clamps it; a remark.

    A rope that hangs from a ring turns about it, so that a marker at twice the distance swings twice as far aside. One
    that is clamped leaves the gripper in one direction and bends beside it, so that near markers swing less.
    """
    if plan.kind != "rope" or plan.held != [[0]] or plan.grasps is not None or plan.mesh is not None:
        return plan, []
    if preset(plan.scenario).obstacles:  # what it touches bends it, too
        return plan, []
    places = np.concatenate([[0.0], np.cumsum(body.measures)])
    numbers = np.arange(len(places)) if plan.markers == "all" else plan.markers
    if isinstance(numbers, str) or numbers is None or plan.start is not None:
        return plan, []
    share = swing_near_the_gripper(recordings, places[np.asarray(numbers)])
    if share is None or share >= _STRAIGHT:
        return plan, []
    return replace(plan, grasps=[[0, 1]], held=[[0, 1]]), [
        f"the gripper clamps the rope: near it markers swing aside by {share:.2g} of what they would if it could turn "
        "there ([scenario] grasps; [[0]] lets it turn)"
    ]


def swing_near_the_gripper(recordings: Sequence[Recording], places: FloatArray) -> float | None:
    """By which share of what a straight rope has it a marker near the gripper swings aside; None if it is not known.

    Args:
        recordings: of a rope that one gripper holds at its beginning.
        places: of the markers along the rope ``(P,)`` [m], from the gripper.
    """
    order = np.argsort(places)
    inner = next((int(k) for k in order if places[k] > 0.0), None)
    if inner is None:
        return None
    outer = int(max(order, key=lambda k: (places[k] <= _WITHIN * places.max()) * places[k]))
    if places[outer] < _APART * places[inner]:
        return None
    near: list[FloatArray] = []
    far: list[FloatArray] = []
    for recording in recordings:
        series, gripper = recording.series, recording.gripper
        if not series.correspondence or series.unit != "m" or gripper is None or gripper.grippers != 1:
            return None
        poses = gripper.at(series.time)[:, 0]
        start = before_it_moves(recording)[0]
        back = inverse(poses[:, 3:])
        for k, found in ((inner, near), (outer, far)):
            at_first = rotate(back[0], start[k] - poses[0, :3])
            found.append(rotate(back, series.points[:, k] - poses[:, :3]) - at_first)
    one, other = np.concatenate(near), np.concatenate(far)
    seen = np.isfinite(one).all(axis=1) & np.isfinite(other).all(axis=1)
    one, other = one[seen], other[seen]
    rough = np.concatenate([fourth_differences(r.series.points) for r in recordings])
    noise = robust_sd(rough) if len(rough) else 0.0
    if not seen.any() or np.sqrt(np.mean(other**2)) <= _SHOWS * noise:
        return None
    slope = np.sum(one * other) / (np.sum(other**2) - other.size * noise**2)
    return float(slope * places[outer] / places[inner])
