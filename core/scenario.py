"""Scenarios: an object, how it is held, what is around it and where its markers sit."""

from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import TypeAlias, cast

import numpy as np

from .arrays import FloatArray, IntArray
from .beside import Beside
from .body import Body
from .camera import Camera
from .errors import InputError
from .interpolation import interpolate
from .kept_bend import KeptBend
from .material import Material, RopeMaterial
from .measurement import Recording
from .motion import Motion, inverse, rotate
from .obstacles import Obstacle
from .scene import Scene
from .series import PointUnit

STANDARD_GRAVITY = 9.80665
#: Clocks [s] and gripper poses [m] that differ by less than this are the same.
_SAME = 1e-6
#: ``(body [world, to scale], poses of the grippers (G, 7), grasps, obstacles, clearance [m]) -> start (V, 3) [m],
#: world``. ``clearance`` is how far from an obstacle's surface a vertex stays. Of a module, so that it pickles.
StartShape: TypeAlias = Callable[[Body, FloatArray, tuple[IntArray, ...], tuple[Obstacle, ...], float], FloatArray]


@dataclass(frozen=True, eq=False)
class StartMotion:
    """How a rope moves as it starts, in the world, at any number of places evenly along it.

    Args:
        velocities: ``(N, 3)`` [m/s].
        accelerations: ``(N, 3)`` [m/s2].
    """

    velocities: FloatArray
    accelerations: FloatArray

    def along(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Velocities and accelerations ``(count, 3)`` of that many vertices."""
        own, wanted = np.arange(float(len(self.velocities))), np.linspace(0, len(self.velocities) - 1, count)
        return interpolate(wanted, own, self.velocities), interpolate(wanted, own, self.accelerations)


@dataclass(frozen=True, eq=False)
class Scenario:
    """Data, not code. The body is given in the frame of the first gripper at its first pose.

    Args:
        name: of the scenario.
        body: rest shape.
        grasps: for every gripper the vertices ``(H_g,)`` that it holds rigidly.
        motion: gripper poses in the world; of one pose only when nothing moves.
        times: observation times ``(T,)`` [s]; the rollout starts at the first.
        markers: weights ``(M, V)`` that give marker positions from vertex positions; rows sum to one.
        load_vertices: where a recording's load hangs, shared equally.
        load: [kg].
        obstacles: what stands around it, in the world.
        start: makes the shape that the object is in before it settles, from the poses that the grippers really
            have then; None: it is in its rest shape. The held vertices sit in their grippers as they start.
        settle: time that the object is given to come to rest before the first observation [s].
        start_motion: how a rope moves as it starts, which then is given no time to settle; None: it is at rest.
        camera: that looks at it, or None where it is not known.
        unit: of what is measured: "px" of that camera, or "m" in the world.
        sampled: the markers are places spread over the object, not spots that are marked on it.
        beside: how far the markers of a rope between two grippers stand beside its axis; None: they sit on it.
        kept: the bend that a rope that starts as it was measured keeps where nothing acts on it; None: not known.
        earlier: where the vertices of a rope were seen before it starts, one after the other ``(H, V, 3)`` [m], where
            what is simulated is a piece of a longer recording; None: what was before is not known.
    """

    name: str
    body: Body
    grasps: tuple[IntArray, ...]
    motion: Motion
    times: FloatArray
    markers: FloatArray
    load_vertices: IntArray
    load: float = 0.0
    obstacles: tuple[Obstacle, ...] = ()
    start: StartShape | None = None
    settle: float = 0.0
    start_motion: StartMotion | None = None
    camera: Camera | None = None
    unit: PointUnit = "m"
    sampled: bool = False
    beside: Beside | None = None
    kept: KeptBend | None = None
    earlier: FloatArray | None = None

    def __post_init__(self) -> None:
        count = len(self.body.vertices)
        for what, ids in [*((f"gripper {g}", v) for g, v in enumerate(self.grasps)), ("the load", self.load_vertices)]:
            if not len(ids) and what.startswith("gripper"):
                raise InputError(f"scenario {self.name!r}: {what} holds no vertex; name some, or leave it out")
            if len(ids) and (ids.min() < 0 or ids.max() >= count):
                bad = int(ids.max() if ids.max() >= count else ids.min())
                raise InputError(
                    f"scenario {self.name!r}: {what} takes vertex {bad}, but the mesh has vertices 0 to {count - 1}"
                )
        if self.motion.grippers < len(self.grasps):
            raise InputError(
                f"scenario {self.name!r} has {len(self.grasps)} grippers, but the motion moves {self.motion.grippers}"
            )
        if self.markers.shape[1] != count:
            raise InputError(
                f"scenario {self.name!r}: marker weights are for {self.markers.shape[1]} vertices, mesh has {count}"
            )
        if self.start_motion is not None and (self.settle > 0 or self.body.kind != "rope"):
            raise InputError(f"scenario {self.name!r}: only a rope that is given no time to settle starts in motion")
        if self.load > 0 and not len(self.load_vertices):
            raise InputError(f"scenario {self.name!r} says nowhere to hang a load of {self.load:g} kg")

    def for_recording(self, recording: Recording) -> "Scenario":
        """The same object under a recording's motion, load, camera and observation times."""
        motion = recording.gripper if recording.gripper is not None else self.motion
        if motion.grippers < len(self.grasps):
            raise InputError(
                f"recording {recording.name!r} has poses of {motion.grippers} grippers, "
                f"but scenario {self.name!r} holds the object with {len(self.grasps)}"
            )
        series = recording.series
        return replace(
            self, motion=motion, times=series.time, load=recording.load, camera=recording.camera, unit=series.unit
        )

    def same_rollout(self, other: "Scenario") -> bool:
        """Whether the other one is this one played again, as with takes of one motion."""
        mine, theirs = ((s.times, s.motion.times, s.motion.poses) for s in (self, other))
        near = (
            a.shape == b.shape and np.allclose(a, b, rtol=0.0, atol=_SAME) for a, b in zip(mine, theirs, strict=True)
        )
        return all(near) and _equal(self, replace(other, times=self.times, motion=self.motion))

    def world_vertices(self, scale: float = 1.0) -> FloatArray:
        """Rest vertices ``(V, 3)`` [m] as held at the start; ``scale`` stretches about the first grasp."""
        about = self.body.vertices[self.grasps[0]].mean(axis=0) if self.grasps else self.body.vertices.mean(axis=0)
        pose = self.motion.at(self.times[:1])[0, 0]
        return np.asarray(rotate(pose[3:], self.body.scaled(scale, about).vertices) + pose[:3])

    def start_vertices(self, scale: float = 1.0, clearance: float = 0.0) -> FloatArray:
        """Where the vertices are before they settle ``(V, 3)`` [m].

        Args:
            scale: of the object's size [1].
            clearance: how far from an obstacle's surface a vertex stays [m].
        """
        rest = self.world_vertices(scale)
        if self.start is None:
            return rest
        body = replace(self.body, vertices=rest)
        return self.start(body, self.motion.at(self.times[:1])[0], self.grasps, self.obstacles, clearance)

    def scene(self, material: Material, gravity: FloatArray, scale: float = 1.0) -> Scene:
        """What an engine builds: ``material`` in SI, ``gravity (3,)`` [m/s2], ``scale`` of the object's size [1]."""
        body = replace(self.body, vertices=self.world_vertices(scale))
        loads = np.zeros(len(body.vertices))
        if self.load > 0:
            loads[self.load_vertices] = self.load / len(self.load_vertices)
        clearance = material.diameter / 2 if isinstance(material, RopeMaterial) else 0.0
        start = None if self.start is None else self.start_vertices(scale, clearance)
        still = (None, None)
        speeds, gains = still if self.start_motion is None else self.start_motion.along(len(body.vertices))
        earlier = None if self.earlier is None else scale * _on_mesh(self.earlier, len(body.vertices))
        twist = 0.0
        if self.beside is not None and start is not None:
            twist = self.beside.twist(start, self.motion.at(self.times[:1])[0])
        return Scene(body, material, gravity, self.grasps, loads, self.obstacles, start, speeds, gains, earlier, twist)

    def held_positions(self, times: FloatArray, vertices: FloatArray) -> FloatArray:
        """Where the held vertices must be ``(T, H, 3)`` [m] at ``times (T,)`` [s].

        They keep the place in their gripper that they have at the start. Where no start shape bends an object between
        two grippers, the second holds it at where it scales to, not at where the gripper itself is.

        Args:
            vertices: world positions at the start ``(V, 3)``, from :meth:`start_vertices`.
        """
        start = self.motion.at(self.times[:1])[0]
        poses = self.motion.at(times)
        parts = []
        for g, ids in enumerate(self.grasps):
            local = rotate(inverse(start[g, 3:]), vertices[ids] - start[g, :3])
            parts.append(rotate(poses[:, g, None, 3:], local[None]) + poses[:, g, None, :3])
        return np.concatenate(parts, axis=1) if parts else np.zeros((len(times), 0, 3))


def _equal(a: object, b: object) -> bool:
    """Whether two values hold the same, down to the numbers in arrays; functions are themselves alone."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return np.array_equal(a, cast(np.ndarray, b))
    if isinstance(a, tuple):
        other = cast(tuple[object, ...], b)
        return len(a) == len(other) and all(map(_equal, a, other))
    if is_dataclass(a):
        return all(_equal(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    return bool(a == b)


def _on_mesh(shapes: FloatArray, count: int) -> FloatArray:
    """Shapes of a rope ``(H, V, 3)``, on a mesh of ``count`` vertices."""
    own, wanted = np.arange(float(shapes.shape[1])), np.linspace(0, shapes.shape[1] - 1, count)
    return interpolate(wanted, own, shapes.swapaxes(0, 1)).swapaxes(0, 1)


def marker_weights(count: int, ids: IntArray) -> FloatArray:
    """Weights ``(M, V)`` of markers that sit on vertices ``ids``."""
    if len(ids) and (ids.min() < 0 or ids.max() >= count):
        wrong = ids[(ids < 0) | (ids >= count)]
        raise InputError(f"a marker sits on vertex {int(wrong[0])}, but the mesh has vertices 0 to {count - 1}")
    weights = np.zeros((len(ids), count))
    weights[np.arange(len(ids)), ids] = 1.0
    return weights


def bound_markers(vertices: FloatArray, points: FloatArray, neighbours: int = 12) -> FloatArray:
    """Weights ``(M, V)`` of markers that are carried rigidly by the object near ``points (M, 3)``.

    Each marker is an affine combination of its nearest vertices, the one of smallest norm that
    reproduces its position at rest: exact for every affine motion of the neighbourhood, so a marker
    on a stalk turns with the surface.
    """
    weights = np.zeros((len(points), len(vertices)))
    for m, p in enumerate(points):
        near = np.argsort(np.linalg.norm(vertices - p, axis=1))[: min(neighbours, len(vertices))]
        local = np.vstack([vertices[near].T - p[:, None], np.ones(len(near))])
        weights[m, near] = np.linalg.pinv(local) @ np.array([0.0, 0.0, 0.0, 1.0])
        if not np.allclose(weights[m] @ vertices, p, atol=1e-6):
            away = float(np.linalg.norm(vertices[near[0]] - p))
            raise InputError(
                f"marker {m} at {np.round(p, 4).tolist()} m, {away:.2g} m from the object, cannot be tied to the "
                "vertices near it, which lie in one plane; check the size of the object, --up and the unit, or give "
                "marker vertices in [scenario] markers"
            )
    return weights
