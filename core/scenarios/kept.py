"""The bend that a rope keeps, the same in all recordings of it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import FloatArray
from ..bending import RopeBending
from ..beside import rope_frames, untwisted_frames
from ..body import Body
from ..kept_bend import KeptBend, StateBend, common_bend, kept_in
from ..material import RopeMaterial
from ..measurement import Recording
from ..motion import inverse, rotate
from ..rest_shape import rolled_out
from ..scenario import STANDARD_GRAVITY, Scenario
from .measured import in_motion, measured_start

#: States of a rope are taken so far apart [s]: nearer ones show the same bends.
_APART = 0.1
#: So many frames must follow a state.
_FRAMES = 10
_ANY = RopeMaterial(linear_density=1.0, stretch_stiffness=1.0, bending_rigidity=1.0)


def told_bend(scenarios: Sequence[Scenario], recordings: Sequence[Recording]) -> KeptBend | None:
    """What states all along ``recordings`` of one rope tell together, in the frames of the material.

    A natural curvature is a property of the rope and turns with its material, which the first gripper holds; what
    friction between its strands and errors of the markers add differs from state to state, so those far off count less.

    Args:
        scenarios: of the recordings, each of which starts as it was measured.
        recordings: what was seen.

    Returns:
        None where no gripper says how the rope is turned about itself.
    """
    if not all(s.grasps and s.body.kind == "rope" and len(s.body.vertices) > 2 for s in scenarios):
        return None
    states = [state for s, r in zip(scenarios, recordings, strict=True) for state in _states(s, r)]
    return common_bend([_told(s) for s in states], np.array([0.0, 0.0, -STANDARD_GRAVITY]))


def bent(scenario: Scenario, curvature: FloatArray) -> Body:
    """The rope of a scenario, bent by ``curvature (V - 2, 2)`` [1/m] at rest, in the frame of the first gripper.

    Its first segment lies as at the start, and so do its axes there.
    """
    body, start = scenario.body, scenario.start_vertices()
    poses = scenario.motion.at(scenario.times[:1])
    frame = untwisted_frames(start[None, :2], poses[:, [0, -1]])[0, 0]  # at the first gripper nothing is twisted yet
    turns = curvature * RopeBending(body, np.concatenate(scenario.grasps)).measures[:, None]
    points = rolled_out(start[0], np.cross(*frame), frame, turns, body.measures)
    return replace(body, vertices=rotate(inverse(poses[0, 0, 3:]), points - poses[0, 0, :3]))


def _states(scenario: Scenario, recording: Recording) -> list[Scenario]:
    """The rope as it starts, and then wherever every marker is seen, some time apart."""
    series = recording.series
    apart = np.linalg.norm(np.diff(series.points, axis=1), axis=2)
    whole = (apart > 0).all(axis=1)  # a comparison with NaN is false
    late = np.floor((series.time - series.time[0]) / _APART + 1e-9)
    out, beside = [scenario], scenario.beside
    if beside is not None:
        series = replace(series, points=beside.axis(series.points, scenario.motion.at(series.time)))
    for part in np.unique(late)[1:]:
        found = np.flatnonzero(whole & (late == part))
        if not len(found) or found[0] + _FRAMES > len(series.time):
            continue
        rest = slice(found[0], None)
        cut = replace(recording, series=replace(series, time=series.time[rest], points=series.points[rest]))
        state = measured_start(replace(scenario, times=series.time[rest]), cut)
        out.append(replace(in_motion(state, series), beside=beside))
    return out


def _told(scenario: Scenario) -> StateBend:
    """From the start of one; by unit of mass and gravity, so neither the material nor gravity counts."""
    scene = scenario.scene(_ANY, np.zeros(3))
    bending = RopeBending(scene.body, scene.held)
    vertices = scene.start_positions
    bending.follow(vertices)
    plain, frames = _frames(scenario, vertices)
    turned = np.sum(frames[:, :1] * plain, axis=2)  # the first axis of the material, in axes that are not twisted
    angle = np.unwrap(np.arctan2(turned[:, 1], turned[:, 0]))
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(vertices, axis=0), axis=1))])
    return kept_in(scene, bending, np.gradient(angle, along)[1:-1]).turned(bending.axes, frames[1:-1])


def _frames(scenario: Scenario, vertices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Axes ``(V, 2, 3)`` of the cross-sections at the start, from the first gripper on: without twist, and as they are.

    They are twisted as the material is where markers beside the axis show that, and without twist where nothing does.
    """
    poses = scenario.motion.at(scenario.times[:1])[:, [0, -1]]
    plain = np.asarray(untwisted_frames(vertices[None], poses)[0])
    if scenario.beside is None:
        return plain, plain
    return plain, np.asarray(rope_frames(vertices[None], poses, scenario.beside.turn, scenario.beside.natural)[0])
