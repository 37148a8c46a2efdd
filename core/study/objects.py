"""From ``[scenario]`` and a recording to a scenario: the object, its grasps, its markers, what stands around it."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..arrays import FloatArray, IntArray
from ..beside import Beside
from ..body import Body, rope_line
from ..errors import InputError
from ..importing.mesh import read_body
from ..measurement import Recording, check_comparable, check_spatial
from ..motion import IDENTITY_POSE, Motion, inverse, rotate
from ..obstacles import Obstacle
from ..scenario import Scenario, StartShape, bound_markers, marker_weights
from ..scenarios import preset
from ..scenarios.grasps import ASK, grasps_at
from ..scenarios.measured import measured_start
from ..scenarios.places import marker_points
from ..scenarios.starts import GivenShape
from ..surface_samples import surface_weights
from .scenario_table import ScenarioTable

#: Places on the object that stand for the points of a cloud.
SURFACE_SAMPLES = 1000
#: An edge that is longer at the start than this times its rest length cannot be meant.
_LARGEST_START_STRETCH = 1.05


def object_of(table: ScenarioTable, folder: Path) -> Body:
    """The object of a study at rest, in the frame that it is given in; ``folder`` is that of the study file."""
    if table.mesh is None:
        return preset(table.name).body(table.size, table.vertices)
    if table.vertices is not None and len(table.vertices) != 1:
        raise InputError(
            f"[scenario.vertices]: with a mesh it is the vertex count of a rope, one number, not {table.vertices}"
        )
    body = read_body(
        folder / table.mesh, table.mesh_scale, table.mesh_up, table.vertices[0] if table.vertices else None
    )
    if table.straight_rest and body.kind != "rope":
        raise InputError(f"[scenario.straight_rest] is for ropes, but {table.mesh} is a {body.kind}")
    return body


def obstacles_of(table: ScenarioTable, folder: Path) -> tuple[Obstacle, ...]:
    """What stands around the object, in the world."""
    if table.obstacles is None:
        return preset(table.name).obstacles
    return tuple(o.build(folder) for o in table.obstacles)


def keep_points(recording: Recording, points: list[int] | None) -> Recording:
    """The recording with only those ``points``, all where none are named."""
    if points is None:
        return recording
    series, count = recording.series, recording.series.points.shape[1]
    wrong = [p for p in points if not 0 <= p < count]
    if wrong:
        raise InputError(
            f"[scenario.points]: recording {recording.name!r} has points 0 to {count - 1}, there is no {wrong[0]}"
        )
    return replace(recording, series=replace(series, points=series.points[:, points]))


def build_scenario(
    table: ScenarioTable, recording: Recording, folder: Path, marked: bool = True, beside: Beside | None = None
) -> Scenario:
    """The scenario of one recording.

    Args:
        table: of the study.
        recording: what happened.
        folder: of the study file.
        marked: points are markers, each with a place on the object; not those that are found in pictures.
        beside: how far the markers stand beside a rope that starts as measured.

    Raises:
        InputError: something in the table cannot be, or does not go with the recording.
    """
    base = preset(table.name)
    given = object_of(table, folder)
    motion = recording.gripper or base.motion(None if table.mesh else given)
    body = _in_gripper_frame(given, table.frame, motion, float(recording.series.time[0]))
    start: StartShape | None = base.start if table.mesh is None else None
    grasps = grasps_of(table, given)
    if recording.gripper is not None and motion.grippers < len(grasps):
        raise InputError(
            f"{table.name!r} holds the object with {len(grasps)} grippers, but recording {recording.name!r} has poses "
            f"of {motion.grippers}; import the poses of all, or take a scenario that holds it with fewer"
        )
    if table.straight_rest:
        held = body.vertices[grasps[0]] if grasps else body.vertices
        start = GivenShape(body.vertices, float(body.measures.sum()), held.mean(axis=0))
        body = _straightened(body)
    plain = Scenario(
        name=table.name,
        body=body,
        grasps=grasps,
        motion=motion,
        times=recording.series.time,
        markers=np.eye(len(body.vertices)),
        load_vertices=np.zeros(0, np.int64) if table.mesh else base.load_vertices(body),
        obstacles=obstacles_of(table, folder),
        start=start,
        settle=base.settle if table.settle is None else table.settle,
    ).for_recording(recording)
    check_comparable(recording)
    if table.start == "measured":
        return measured_start(plain, recording, beside)
    if not marked:
        return plain
    if table.marker_points is not None:
        weights = marker_points(given, np.array(table.marker_points).reshape(-1, 3))
        return replace(plain, markers=_as_many(weights, recording, "marker_points", "points"))
    return replace(plain, markers=_markers(table.markers, plain, recording), sampled=table.markers == "surface")


def _in_gripper_frame(body: Body, frame: str, motion: Motion, start: float) -> Body:
    if frame in ("gripper", "markers"):
        return body
    pose = motion.at(np.array([start]))[0, 0] if motion.grippers else IDENTITY_POSE
    away = body.vertices - pose[:3] if frame == "world" else body.vertices
    return replace(body, vertices=rotate(inverse(pose[3:]), away))


def _straightened(body: Body) -> Body:
    """A straight rope of the same segments along its first one."""
    points = body.vertices
    along = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    made = rope_line(np.stack([points[0], points[0] + along * body.measures.sum()]), len(points))
    lengths = np.concatenate([[0.0], np.cumsum(body.measures)])
    return replace(made, vertices=points[0] + lengths[:, None] * along)


def grasps_of(table: ScenarioTable, given: Body) -> tuple[IntArray, ...]:
    """For every gripper the vertices that it holds of the object as it is given."""
    base = preset(table.name)
    if table.grasps is not None:
        return tuple(np.array(g, np.int64) for g in table.grasps)
    if table.grasp_points is not None:
        return grasps_at(given, [np.array(p, float).reshape(-1, 3) for p in table.grasp_points], table.grasp_radius)
    if given.kind not in base.kinds:
        raise InputError(f"[scenario]: {table.name!r} holds a {base.kind}, but {table.mesh} is a {given.kind}; {ASK}")
    return base.grasps(given)


def check_unstretched(scenario: Scenario, scale: float, where: str) -> None:
    """Raise :class:`InputError` if the object would start in a shape too large for it; ``where`` is for messages."""
    rest = scenario.world_vertices(scale)
    lengths = scenario.body.edge_lengths(rest)
    ratio = float((scenario.body.edge_lengths(scenario.start_vertices(scale)) / lengths).max())
    if ratio <= _LARGEST_START_STRETCH:
        return
    apart = ""
    if scenario.motion.grippers > 1 and scenario.body.kind == "rope":
        ends = scenario.motion.at(scenario.times[:1])[0, :2, :3]
        apart = (
            f": the grippers are {np.linalg.norm(ends[1] - ends[0]):.3g} m apart, but the rope is "
            f"{lengths.sum():.3g} m long"
        )
    raise InputError(
        f"{where}: the object would start stretched to {ratio:.3g} times its length{apart}; check the size in "
        "[scenario], the gripper poses and their unit"
    )


def _markers(choice: list[int] | str | None, scenario: Scenario, recording: Recording) -> FloatArray:
    count, points = len(scenario.body.vertices), recording.series.points
    if choice == "surface":
        if recording.series.correspondence:
            raise InputError(
                "[scenario] markers = 'surface' is for clouds, whose points are anywhere on the object, but recording "
                f"{recording.name!r} follows its points; say 'all', 'bound' or a vertex for each"
            )
        return surface_weights(scenario.body, SURFACE_SAMPLES)
    if choice == "bound":
        check_spatial(recording)
        if scenario.settle > 0:
            raise InputError(
                "[scenario] markers = 'bound' ties each marker to the object where it starts, so it cannot go with "
                f"settle = {scenario.settle:g}; set settle = 0, or name the vertices under the markers"
            )
        seen = recording.series.valid[0]
        if not seen.all():
            raise InputError(
                f"recording {recording.name!r}: marker {int(np.argmin(seen))} is not seen in the first frame, "
                "so it cannot be bound to the object; start the recording later or give [scenario.markers] vertices"
            )
        try:
            return bound_markers(scenario.start_vertices(), points[0])
        except InputError as error:
            raise InputError(f"recording {recording.name!r}: {error}") from error
    if isinstance(choice, list):
        return _as_many(marker_weights(count, np.array(choice, np.int64)), recording, "markers", "vertices")
    if recording.series.correspondence and points.shape[1] != count:
        raise InputError(
            f"recording {recording.name!r} has {points.shape[1]} points, the mesh {count} vertices; say where the "
            "markers sit: [scenario] markers = [vertex, ...], or markers = 'bound' to tie each to the object where "
            "it is in the first frame, or import without --correspondence"
        )
    return np.eye(count)


def _as_many(weights: FloatArray, recording: Recording, key: str, what: str) -> FloatArray:
    """The weights, if they are as many as the points that are followed."""
    count = recording.series.points.shape[1]
    if recording.series.correspondence and len(weights) != count:
        raise InputError(
            f"[scenario.{key}] names {len(weights)} {what}, but recording {recording.name!r} has {count} points"
        )
    return weights
