"""The world: substeps, held vertices, nodal forces, damping and Bullet's contact."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import RolloutFailed
from ...core.obstacles import Table
from ...core.scene import Scene
from ...core.simulator import State, World
from .client import Client
from .colliders import NodeContact, add_tables
from .elasticity import Elasticity

#: Substep times the fastest angular frequency at rest; the scheme is unstable from 2, strain may stiffen the body.
_STEP_TIMES_FREQUENCY = 1.0
#: A position [m] or velocity [m/s] beyond this is a blow-up.
_FARTHEST = 1e4
#: A vertex this near to a table, besides its own radius, is left to Bullet [m].
_WATCH = 0.001


class SoftWorld(World):
    """One soft body in one Bullet world.

    The elastic forces are computed here; Bullet's own have no bending rigidity, or are mesh-dependent. So is
    contact with curved obstacles. Before each of Bullet's steps the velocities are given what weight, nodal forces
    and elasticity add in that time, ``v += f / m dt``, with the true masses. Bullet then integrates (symplectic
    Euler, ``x += v dt``) and keeps the vertices out of tables, with Coulomb friction; tables do not move, so what
    it does to a velocity is right whatever the mass. A substep in which nothing is in reach of a table is
    ``x += v dt`` and no more, and is done here: the same numbers, without the way to Bullet and back.

    Held vertices are infinitely heavy in Bullet and move on straight lines at the velocity that brings them to
    their place at the end of the step.

    Damping C = beta K is implicit, in every substep: done every few substeps it resonates with the fastest
    vibrations and feeds them.

    Args:
        scene: to build.
        time_step: of the world [s].
        most_substeps: give up where stability needs more in one step.
        elasticity: of the body.

    Raises:
        RolloutFailed: a vertex has no mass, or the body is too stiff for its mesh.
    """

    def __init__(self, scene: Scene, time_step: float, most_substeps: int, elasticity: Elasticity) -> None:
        body = scene.body
        count = len(body.vertices)
        self.time_step = time_step
        self.masses = body.vertex_measures * scene.material.density + scene.loads
        if not self.masses.min() > 0:
            raise RolloutFailed(f"vertex {int(self.masses.argmin())} has no mass")
        self._held, self._free = scene.held, np.ones(count, dtype=np.bool_)
        self._free[scene.held] = False
        self._elasticity = elasticity
        self._weight = self.masses[:, None] * scene.gravity
        self._inverse = 1.0 / self.masses[:, None]
        self._beta = scene.material.damping_time
        self._most_substeps = most_substeps
        self._needed = time_step * elasticity.fastest(body.vertices, self.masses, self._free) / _STEP_TIMES_FREQUENCY
        self._substeps = self._substeps_with(None)

        self._positions = scene.start_positions.astype(np.float64)
        self._velocities = np.zeros((count, 3))
        self._contact = np.zeros((count, 3))
        self._buffer = np.empty((count, 4))
        self._client: Client | None = None
        friction, radius = scene.material.friction, scene.contact_radius
        tables = [o.height + radius for o in scene.obstacles if isinstance(o, Table)]
        self._reach = max(tables, default=-np.inf) + _WATCH
        self._touch = [
            NodeContact(o, friction, radius, self._free) for o in scene.obstacles if not isinstance(o, Table)
        ]
        self._touching = bool(scene.obstacles)
        self._current = False
        if tables:
            self._client = Client()
            try:
                add_tables(self._client, scene.obstacles, friction)
                self._client.load(count, float(self.masses.sum()), radius)
                self._client.fix(scene.held)
            except BaseException:
                self._client.close()
                raise

    def _substeps_with(self, stiffness: FloatArray | None) -> int:
        """How many substeps a step needs with ``stiffness (E,)`` times the stretch stiffness."""
        needed = self._needed if stiffness is None else self._needed * float(np.sqrt(max(stiffness.max(), 1.0)))
        if not needed <= self._most_substeps:
            raise RolloutFailed(
                f"explicit elasticity needs {needed:.0f} substeps in {self.time_step:g} s; at most "
                f"{self._most_substeps} are allowed. The material is too stiff or too light for so fine a mesh"
            )
        return max(1, int(np.ceil(needed)))

    def state(self) -> State:
        return State(self._positions, self._velocities, self._contact.copy if self._touching else None)

    def step(self, held: FloatArray, forces: FloatArray | None, stiffness: FloatArray | None = None) -> None:
        substeps = self._substeps if stiffness is None else self._substeps_with(stiffness)
        dt = self.time_step / substeps
        self._elasticity.scale_stretch(stiffness)
        push = self._weight if forces is None else self._weight + forces
        pull = (held - self._positions[self._held]) / self.time_step
        pace = dt * self._inverse
        x, v = self._positions, self._velocities
        pushed = np.zeros_like(x)
        if self._client is not None:
            self._client.set_time_step(dt)
        for _ in range(substeps):
            force = self._elasticity.forces(x)
            force += push
            force *= pace
            v = np.add(v, force, out=force)
            v[self._held] = pull
            if self._beta > 0:
                v = self._elasticity.damped(v, self.masses, self._free, self._beta * dt)
            shift: FloatArray | None = None
            if self._touch:
                before = v.copy()
                for touch in self._touch:
                    more = touch(x, v, dt)
                    shift = more if shift is None else shift if more is None else shift + more
                pushed += v - before
            moved = x + dt * v
            if self._client is not None and moved[:, 2].min() < self._reach:
                moved, after = self._bullet(x, v)
                pushed += after - v
                v = after
            else:
                self._current = False
            if shift is not None:
                moved += shift
                self._current = False
            x = moved
        if not np.isfinite(x.sum() + v.sum()):
            raise RolloutFailed("positions are not finite")
        if len(self._held):
            x[self._held], v[self._held] = held, pull  # takes away the rounding of the substeps
            self._current = False
        self._positions, self._velocities = x, v
        self._contact = self.masses[:, None] / self.time_step * pushed

    def _bullet(self, positions: FloatArray, velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions and velocities after a step of Bullet; besides contact it takes penetration back bit by bit."""
        client = self._client
        assert client is not None
        # Bullet must not see what is not finite or overflows: its trees of boxes would not survive it.
        if not max(np.abs(positions).max(), np.abs(velocities).max()) < _FARTHEST:
            raise RolloutFailed("a vertex is not finite, or farther away or faster than anything real")
        if not self._current:
            client.set_positions(positions)
            self._current = True
        client.set_velocities(velocities)
        client.step()
        client.read_positions(self._buffer)
        moved = self._buffer[:, :3].copy()
        client.read_velocities(self._buffer)
        return moved, self._buffer[:, :3].copy()

    def close(self) -> None:
        if self._client is not None:
            self._client.close()
