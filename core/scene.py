"""A scene: everything an engine needs to build one world, resolved to numbers."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .arrays import FloatArray, IntArray
from .body import Body
from .errors import InputError
from .material import Material, RopeMaterial
from .obstacles import Obstacle


@dataclass(frozen=True, eq=False)
class Scene:
    """One object in its surroundings at the start of a rollout, in the world frame (z up).

    Args:
        body: the mesh in its rest shape, free of stress.
        material: in SI.
        gravity: ``(3,)`` [m/s2].
        grasps: for every gripper the vertices ``(H_g,)`` that follow its command; may be empty.
        loads: extra point mass on every vertex ``(V,)`` [kg].
        obstacles: what stands around it.
        start: where the vertices are at time zero ``(V, 3)`` [m]; None: in the rest shape.
        start_velocities: at time zero ``(V, 3)`` [m/s], of those that are not held; None: at rest.
        start_accelerations: ``(V, 3)`` [m/s2] that were measured then, which whatever the object's forces are must
            give; None: not known. Engines do not need them.
        earlier: shapes that a rope was in before, one after the other ``(H, V, 3)`` [m], wherever they were; None: not
            known. Engines do not need them; effects with a memory do.
        start_twist: angle by which the last segment of a rope is turned about itself at time zero, seen from the first
            one's material axes that are carried along without twist [rad].
    """

    body: Body
    material: Material
    gravity: FloatArray
    grasps: tuple[IntArray, ...]
    loads: FloatArray
    obstacles: tuple[Obstacle, ...] = ()
    start: FloatArray | None = None
    start_velocities: FloatArray | None = None
    start_accelerations: FloatArray | None = None
    earlier: FloatArray | None = None
    start_twist: float = 0.0

    def __post_init__(self) -> None:
        for what in ("start", "start_velocities", "start_accelerations"):
            given: FloatArray | None = getattr(self, what)
            if given is not None and given.shape != self.body.vertices.shape:
                raise InputError(f"{what} has shape {given.shape}, the mesh {self.body.vertices.shape}")

    @cached_property
    def held(self) -> IntArray:
        """The vertices ``(H,)`` that follow a command, gripper by gripper."""
        return np.concatenate([np.zeros(0, np.int64), *self.grasps]).astype(np.int64)

    @property
    def start_positions(self) -> FloatArray:
        """Where the vertices are at time zero ``(V, 3)`` [m]."""
        return self.body.vertices if self.start is None else self.start

    @property
    def contact_radius(self) -> float:
        """How far from an obstacle's surface a vertex stays that touches it [m]."""
        return self.material.diameter / 2 if isinstance(self.material, RopeMaterial) else 0.0
