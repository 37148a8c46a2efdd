"""What cloth and solid worlds share: substeps, held vertices, nodal forces and damping around Bullet's step."""

from abc import abstractmethod

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import RolloutFailed
from ...core.obstacles import Table
from ...core.scene import Scene
from ...core.simulator import State, World
from .client import Client
from .elasticity import Elasticity
from .meshfile import mesh_file

#: Substep times the fastest angular frequency at rest; the scheme is unstable from 2, strain may stiffen the body.
_STEP_TIMES_FREQUENCY = 1.0


class SoftWorld(World):
    """One soft body in one Bullet world.

    Bullet integrates (symplectic Euler), keeps the vertices off the table with Coulomb friction and, for
    solids, computes the elastic forces. It knows neither nodal forces nor masses that differ from vertex to
    vertex, so before each of its steps the velocities are given what weight, nodal forces and the elasticity
    computed here add in that time, ``v += f / m dt``, with the true masses. A step without forces and contact
    is therefore exact free fall. Held vertices are infinitely heavy in Bullet and move on straight lines at
    the velocity that brings them to their place at the end of the step.

    Damping C = beta K is implicit, in every substep: done every few substeps it resonates with the fastest
    vibrations and feeds them.

    Args:
        scene: to build.
        time_step: of the world [s].
        most_substeps: give up where stability needs more in one step.
        elasticity: of the body.
        lame: Bullet's Neo-Hookean constants [Pa], or None for a body whose elasticity is not Bullet's.

    Raises:
        RolloutFailed: a vertex has no mass, or the body is too stiff for its mesh.
    """

    def __init__(
        self,
        scene: Scene,
        time_step: float,
        most_substeps: int,
        elasticity: Elasticity,
        lame: tuple[float, float] | None,
    ) -> None:
        body = scene.body
        count = len(body.vertices)
        self.time_step = time_step
        own = body.vertex_measures * scene.material.density
        self.masses = own + scene.loads
        if not self.masses.min() > 0:
            raise RolloutFailed(f"vertex {int(self.masses.argmin())} has no mass")
        self._held = scene.held
        self._free = np.ones(count, dtype=np.bool_)
        self._free[scene.held] = False
        self._elasticity = elasticity
        self._weight = self.masses[:, None] * scene.gravity
        self._positions = body.vertices.astype(np.float64)
        self._velocities = np.zeros((count, 3))
        self._equal_share = float(own.mean())
        self._beta = scene.material.damping_time

        lightest = np.minimum(self.masses, self._equal_share)
        frequency = elasticity.fastest(self._positions, lightest, self._free)
        needed = time_step * frequency / _STEP_TIMES_FREQUENCY
        if not needed <= most_substeps:
            raise RolloutFailed(
                f"explicit elasticity needs {needed:.0f} substeps in {time_step:g} s; at most {most_substeps} are "
                "allowed. The material is too stiff or too light for so fine a mesh"
            )
        self._substeps = max(1, int(np.ceil(needed)))
        self._dt = time_step / self._substeps
        self._pace = self._dt / self.masses[:, None]

        self._client = Client(self._dt)
        try:
            for table in scene.obstacles:
                assert isinstance(table, Table)
                self._client.add_table(table.height, scene.material.friction * table.friction)
            with mesh_file(body) as path:
                self._client.load(path, count * self._equal_share, count, lame)
            self._client.fix(scene.held)
            self._client.set_positions(self._positions)  # an .obj was read in single precision
        except BaseException:
            self._client.close()
            raise

    def state(self) -> State:
        return State(self._positions, self._velocities)

    def step(self, held: FloatArray, forces: FloatArray | None, stiffness: FloatArray | None = None) -> None:
        push = self._weight if forces is None else self._weight + forces
        pull = (held - self._positions[self._held]) / self.time_step
        x, v = self._positions, self._velocities
        for _ in range(self._substeps):
            x, v = self._advance(x, v, push, pull)
        if not np.isfinite(x.sum() + v.sum()):
            raise RolloutFailed("Bullet's positions are not finite")
        if len(self._held):
            x[self._held], v[self._held] = held, pull  # takes away the rounding of the substeps
            self._client.set_positions(x)
        self._positions, self._velocities = x, v

    def close(self) -> None:
        self._client.close()

    def _kicked(self, velocities: FloatArray, forces: FloatArray, pull: FloatArray) -> FloatArray:
        """Velocities ``(V, 3)`` [m/s] after ``forces (V, 3)`` [N] acted for a substep; held vertices take ``pull``."""
        velocities = velocities + self._pace * forces
        velocities[self._held] = pull
        return velocities

    def _bullet(self, velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions and velocities after a step of Bullet that began with ``velocities``."""
        self._client.set_velocities(velocities)
        self._client.step()
        return self._client.positions(), self._client.velocities()

    @abstractmethod
    def _advance(
        self, positions: FloatArray, velocities: FloatArray, push: FloatArray, pull: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Make a substep.

        Damping comes after all other forces but contact: a force that is added behind it would not be
        balanced at rest by one that went through it.

        Args:
            positions: ``(V, 3)`` [m], where Bullet has the vertices.
            velocities: ``(V, 3)`` [m/s].
            push: forces ``(V, 3)`` [N] other than elastic, damping and contact ones.
            pull: velocities of the held vertices ``(H, 3)`` [m/s].

        Returns:
            Positions, to which Bullet's vertices were brought, and velocities; new arrays.
        """
