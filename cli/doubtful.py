"""Warnings where recordings and a scenario do not go together at the first frame."""

import numpy as np

from ..core.body import Body
from ..core.measurement import Recording
from ..core.pose_span import uncovered
from ..core.scenario import Scenario
from ..core.study import Problem
from .rope_start import like_a_rope

#: At the start points are no further from where the model puts them than this share of the object's size; as the model
#: does not know how a real object hangs they are some hundredths of it away.
_ELSEWHERE = 0.4
#: A point further than this share of the object's size from it is probably in another frame.
_FAR = 0.25


def doubtful_starts(problem: Problem) -> list[str]:
    """Warnings where the recordings and the scenario do not go together at the first frame."""
    remarks = []
    for name, recording in problem.recordings.items():
        scenario = problem.scenarios[name]
        moves = bool(np.ptp(scenario.motion.poses, axis=0).any())
        if recording.gripper is None and moves and scenario.grasps:
            remarks.append(
                f"warning: {name} has no gripper poses, so the built-in motion of {scenario.name!r} is taken; import "
                "the measured one with --gripper, or use scenario 'hang' if the grippers did not move"
            )
        if recording.gripper is not None and recording.gripper.grippers > len(scenario.grasps) > 0:
            remarks.append(
                f"warning: {name} has {recording.gripper.grippers} grippers, but the object is held by "
                f"{len(scenario.grasps)}; give every gripper its vertices in [scenario] grasps"
            )
        remarks += [f"warning: {name}: {remark}" for remark in uncovered(recording)]
        parts = _parts(scenario.body)
        if parts > 1:
            remarks.append(
                f"warning: the mesh is {parts} parts that do not hang together; sew them (merge vertices by distance), "
                "or hold each"
            )
        apart, size = _apart(recording, scenario), float(np.ptp(scenario.start_vertices(), axis=0).max())
        if apart > _ELSEWHERE * size:
            remarks.append(
                f"warning: {name} starts {apart:.2g} m away from where the model puts the object; check --up, the "
                "unit, the gripper poses (x y z, then the quaternion w x y z), the scenario and the size"
            )
        remarks += _out_of_hand(recording, scenario, size)
        if scenario.body.kind == "solid":
            remarks += _beside(recording, scenario)
        if scenario.body.kind == "cloth" and like_a_rope(recording.series.points[0]):
            remarks.append(
                f"warning: all points of {name} start on one line; if they are those of a rope, give its length with "
                "--size LENGTH"
            )
    return list(dict.fromkeys(remarks))


def _out_of_hand(recording: Recording, scenario: Scenario, size: float) -> list[str]:
    """A warning where a gripper starts far from what it holds, of an object that is placed by something else."""
    if recording.gripper is None:
        return []
    vertices, hands = scenario.start_vertices(), scenario.motion.at(scenario.times[:1])[0, :, :3]
    far = [float(np.linalg.norm(vertices[v].mean(axis=0) - h)) for v, h in zip(scenario.grasps, hands, strict=False)]
    return [
        f"warning: gripper {g} of {recording.name} starts {away:.2g} m from what it holds; check --up, the unit and "
        "the gripper poses, or say in [scenario] grasps what it does hold"
        for g, away in enumerate(far)
        if away > _ELSEWHERE * size
    ]


def _apart(recording: Recording, scenario: Scenario) -> float:
    """How far the points of the first frame are from where the model puts them, root mean square [m].

    Of points that nothing tells apart, how far their middle is from that of the object; zero of none in space.
    """
    series, vertices = recording.series, scenario.start_vertices()
    first = series.points[0]
    seen = np.isfinite(first).all(axis=1)
    if not seen.any() or first.shape[1] != 3:
        return 0.0
    if not series.correspondence or scenario.sampled:
        return float(np.linalg.norm(np.median(first[seen], axis=0) - np.median(vertices, axis=0)))
    return float(np.sqrt(np.mean(np.sum((first - scenario.markers @ vertices)[seen] ** 2, axis=1))))


def _beside(recording: Recording, scenario: Scenario) -> list[str]:
    """A warning where a marker starts far from the object: one that is tied to it goes along, wherever it is."""
    first, vertices = recording.series.points[0], scenario.start_vertices()
    seen = np.isfinite(first).all(axis=1)
    if not recording.series.correspondence or not seen.any() or first.shape[1] != 3:
        return []
    away = np.where(seen, np.linalg.norm(first[:, None] - vertices[None], axis=2).min(axis=1), 0.0)
    if away.max() <= _FAR * float(np.ptp(vertices, axis=0).max()):
        return []
    return [
        f"warning: {recording.name}: point {int(away.argmax())} is {away.max():.2g} m from the object at the start; "
        "leave it out with --points if it is not on the object, or check the size, --up and the unit"
    ]


def _parts(body: Body) -> int:
    """How many pieces the mesh is."""
    piece = np.arange(len(body.vertices))
    a, b = body.edges.T
    while True:
        low = np.minimum(piece[a], piece[b])
        before = piece.copy()
        np.minimum.at(piece, a, low)
        np.minimum.at(piece, b, low)
        piece = piece[piece]  # as everything that this one has been joined to
        if np.array_equal(piece, before):
            return len(np.unique(piece))
