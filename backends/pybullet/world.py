"""The world: substeps, held vertices, nodal forces, damping and contact."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import RolloutFailed
from ...core.scene import Scene
from ...core.simulator import State, World
from .contact import surfaces
from .elasticity import Elasticity
from .substep import Drive, Matter
from .tables import Tables

#: Substep times the fastest angular frequency at rest; the scheme is unstable from 2, strain may stiffen the body.
_STEP_TIMES_FREQUENCY = 1.0


class SoftWorld(World):
    """One soft body in Bullet's worlds.

    The elastic forces are computed here; Bullet's own have no bending rigidity, or are mesh-dependent. So is
    contact with curved obstacles. In every substep the velocities are given what weight, nodal forces
    and elasticity add in that time, ``v += f / m dt``, with the true masses, and then ``x += v dt`` (symplectic
    Euler). That is done in machine code, :mod:`~muslin.backends.pybullet.substep`, and is what Bullet does with nodes
    that touch nothing. Vertices that would end a substep inside a table are moved by Bullet, which keeps them out, with
    Coulomb friction.

    Held vertices touch nothing, and move on straight lines at the velocity that brings them to
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
        free = np.ones(count, dtype=np.bool_)
        free[scene.held] = False
        self._matter = Matter(self.masses, free, scene.held.copy())
        self._elasticity = elasticity
        self._weight = self.masses[:, None] * scene.gravity
        self._beta = scene.material.damping_time
        self._most_substeps = most_substeps
        self._needed = time_step * elasticity.fastest(body.vertices, self.masses, free) / _STEP_TIMES_FREQUENCY
        self._substeps = self._substeps_with(None)

        self._positions = scene.start_positions.astype(np.float64)
        given = scene.start_velocities
        self._velocities = np.zeros((count, 3)) if given is None else given.astype(np.float64)
        self._contact = np.zeros((count, 3))
        self._past = np.zeros((2, count, 3))
        friction, radius = scene.material.friction, scene.contact_radius
        self._surfaces = surfaces(scene.obstacles, friction, radius, count)
        self._tables = Tables(scene.obstacles, friction, radius, count)
        self._touching = bool(scene.obstacles)

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

    def step(
        self,
        held: FloatArray,
        forces: FloatArray | None,
        stiffness: FloatArray | None = None,
        turns: FloatArray | None = None,
    ) -> None:
        substeps = self._substeps if stiffness is None else self._substeps_with(stiffness)
        dt = self.time_step / substeps
        self._elasticity.scale_stretch(stiffness)
        matter, tau = self._matter, self._beta * dt
        push = self._weight if forces is None else self._weight + forces
        pull = (held - self._positions[matter.held]) / self.time_step
        precondition = matter.free / (self.masses + tau * self._elasticity.diagonal)
        drive = Drive(
            dt, substeps, np.ascontiguousarray(push), np.ascontiguousarray(pull), tau, precondition, self._tables.reach
        )
        x, v = self._positions.copy(), self._velocities.copy()
        shift, pushed = np.zeros_like(x), np.zeros_like(x)
        near = np.empty(len(x), np.int64)
        fixed = (self._elasticity.data, matter, self._surfaces, drive, x, v, shift, pushed, self._past, near)
        done = 0
        while done < substeps:
            done, touching = self._elasticity.kernels.advance(*fixed, done)
            if touching:
                which = near[:touching]
                place, velocity = self._tables.step(x[which], v[which], dt)
                pushed[which] += velocity - v[which]
                x[which], v[which] = place + shift[which], velocity
        if not np.isfinite(x.sum() + v.sum()):
            raise RolloutFailed("positions are not finite")
        if len(matter.held):
            x[matter.held], v[matter.held] = held, pull  # takes away the rounding of the substeps
        self._positions, self._velocities = x, v
        self._contact = self.masses[:, None] / self.time_step * pushed

    def close(self) -> None:
        self._tables.close()
