"""One flex in MuJoCo, stepped by the implicit ``discrete`` integrator."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import RolloutFailed
from ...core.material import RopeMaterial
from ...core.scene import Scene
from ...core.simulator import State, World
from .engine import WARNINGS, engine
from .gliding import Gliding, Thrown, TwoStep
from .lengthening import Lengthening
from .model import compiled
from .rod import looking_back, start_turn, start_twists
from .soft_bending import SoftBending
from .turning import Turning

#: How far beyond MuJoCo's own step, as a part of it, cloth and solids are thrown, see :class:`~.gliding.Thrown`; 1
#: would not damp at all.
OVERSHOOT = 0.9
#: The smallest factor on a stiffness: MuJoCo leaves out a flex of which the first number is zero.
_SMALLEST_FACTOR = 1e-9


class MujocoWorld(World):
    """Generalised coordinates are vertex displacements from the rest shape, then the twists of a rope's segments.

    A step in which the object touches nothing is made by :mod:`.gliding`, one in which it does by implicit Euler: what
    is thrown forward through a contact would come back from it.
    """

    def __init__(self, scene: Scene, time_step: float) -> None:
        self._step = engine().mj_step
        self.time_step = time_step
        WARNINGS.clear()
        try:
            made = compiled(scene, time_step)
        except ValueError as error:
            raise RolloutFailed(f"MuJoCo refuses the model: {str(error).splitlines()[0]}") from error
        self._model, self.masses = made.model, made.masses
        self._data = engine().MjData(self._model)
        engine().mj_setConst(self._model, self._data)
        count = 3 * len(scene.body.vertices)
        data = self._data
        self._qpos, self._qvel, self._warnings = data.qpos, data.qvel, data.warning.number
        self._moved, self._push, self._touch = (
            data.qpos[:count],
            data.qfrc_applied[:count],
            data.qfrc_constraint[:count],
        )
        self._rest = scene.body.vertices.ravel()
        self._turn = made.turn
        self._moved[:] = self._inward(scene.start_positions - scene.body.vertices).ravel()
        if scene.body.kind == "rope":
            turned = start_turn(scene.body, scene.start_positions, scene.held)
            self._qpos[count:] = turned + start_twists(scene.body, scene.held, scene.start_twist)
        if scene.start_velocities is not None:
            self._qvel[:count] = self._inward(scene.start_velocities).ravel()
        self._commanded = made.commanded
        self._rest_held = self._rest[self._commanded[: 3 * len(scene.held)]]
        self._target = self._qpos[self._commanded]  # a copy
        self._target_held = self._target[: len(self._rest_held)]
        self._target_turns = self._target[len(self._rest_held) :]
        self._start_turns = self._target_turns.copy()
        self._positions = np.empty((count // 3, 3))
        self._flat = self._positions.reshape(-1)
        self._velocities = self._qvel[:count].reshape(-1, 3)
        if self._turn is not None:
            self._velocities = np.empty((count // 3, 3))
        self._state = State(self._positions, self._velocities, self._contact_forces if scene.obstacles else None)
        self._loaded = self._stretched = False
        self._before = np.empty_like(self._qpos), np.empty_like(self._qvel)
        self._moving = self._qvel[:count]
        self._driven = np.zeros(len(self._commanded))
        self._damping_times = made.damping_times
        self._touching = False
        self._elapsed = 0.0  # MuJoCo's own clock runs at the pace of its own steps
        soft = made.soft_bending
        self._bending = SoftBending(soft, scene.material.damping_time) if soft.size else None
        self._gliding: Gliding = Thrown(time_step, OVERSHOOT, count)
        if isinstance(scene.material, RopeMaterial):
            back = looking_back(scene.body, scene.material, scene.held, time_step)
            self._gliding = TwoStep(time_step, back, count)
        self._paced, self._stretch_damped = (0.0, 0.0), 0.0
        self._stretch, self._cells = made.stretch, made.cells
        self._turning: Turning | None = None
        if len(made.segments):
            lengths = self._model.flexedge_length0
            self._turning = Turning(scene.body.vertices, made.stretch, lengths, made.segments)
        self._lengthening: Lengthening | None = None
        if scene.body.kind == "cloth" and scene.material.damping_time > time_step:
            self._lengthening = Lengthening(scene.body.elements, scene.body.vertices, made.stretch)
        self._plain = np.array(made.stretch)
        self._parts = np.bincount(made.cells, minlength=len(made.stretch))

    def state(self) -> State:
        if self._turn is None:
            np.add(self._rest, self._moved, out=self._flat)
        else:
            np.add(self._rest, (self._moved.reshape(-1, 3) @ self._turn.T).ravel(), out=self._flat)
            np.matmul(self._qvel.reshape(-1, 3), self._turn.T, out=self._velocities)
        return self._state

    def _inward(self, vectors: FloatArray) -> FloatArray:
        """World vectors ``(N, 3)`` along the axes of the displacements."""
        return vectors if self._turn is None else np.asarray(vectors @ self._turn)

    def step(
        self,
        held: FloatArray,
        forces: FloatArray | None,
        stiffness: FloatArray | None = None,
        turns: FloatArray | None = None,
    ) -> None:
        self._elapsed += self.time_step
        if forces is not None:
            if not np.isfinite(forces.sum()):  # MuJoCo would leave out the steps and say nothing
                raise RolloutFailed(f"a nodal force is not finite {self._elapsed:.3f} s after the start")
            forces = self._inward(forces).ravel()
        if stiffness is not None or self._stretched:
            self._set_stiffness(stiffness)
        if self._lengthening is not None:
            free = self._lengthening.force(self._moved.reshape(-1, 3), self._damping_times[0] / self.time_step - 1.0)
            forces = free if forces is None else forces + free
        qpos, qvel, commanded = self._qpos, self._qvel, self._commanded
        np.subtract(held.ravel(), self._rest_held, out=self._target_held)
        if self._turn is not None:
            self._target_held[:] = (self._target_held.reshape(-1, 3) @ self._turn).ravel()
        if turns is not None and len(self._start_turns):  # a rope of one segment has no twist
            np.add(self._start_turns, turns, out=self._target_turns)
        if self._touching or not self._glide(forces):
            if self._turning is not None:
                self._turning.forget()
            self._pace(self.time_step, self.time_step)
            self._drive(self.time_step)
            self._load(forces, 0.0)
            self._step(self._model, self._data)
            self._touching = self._data.ncon > 0
            self._gliding.forget()
        qpos[commanded], qvel[commanded] = self._target, self._driven
        if np.count_nonzero(self._warnings):
            raise RolloutFailed(
                f"MuJoCo warned {self._elapsed:.3f} s after the start: {' '.join(WARNINGS) or 'no text'}"
            )

    def _load(self, forces: FloatArray | None, ahead: float) -> None:
        """Hand over nodal forces ``(3 V,)`` [N] and the bending of a state ``ahead`` [s]."""
        if self._bending is not None:
            count = len(self._moved)
            np.negative(self._bending(self._moved, self._qvel[:count], ahead), out=self._push)
            if forces is not None:
                self._push += forces
        elif forces is not None:
            self._push[:] = forces
            self._loaded = True
        elif self._loaded:
            self._push[:] = 0.0
            self._loaded = False

    def _drive(self, way: float) -> None:
        """Let what is held move as fast as takes it in the time ``way`` [s] to where it shall be."""
        np.subtract(self._target, self._qpos[self._commanded], out=self._driven)
        self._driven /= way
        self._qvel[self._commanded] = self._driven

    def _glide(self, forces: FloatArray | None) -> bool:
        """Make a step if nothing is touched in it; otherwise leave all as it was and say so.

        The twists of a rope, which have next to no inertia, stay where MuJoCo finds them in balance.
        """
        gliding = self._gliding
        self._before[0][:], self._before[1][:] = self._qpos, self._qvel
        self._pace(gliding.step, gliding.own_damping)
        gliding.begin(self._moved, self._moving)
        self._drive(gliding.way)
        pushed = gliding.forces(forces)
        turned = self._turned()
        if turned is not None:
            pushed = turned if pushed is None else pushed + turned
        self._load(pushed, self.time_step - gliding.step)
        self._step(self._model, self._data)
        if self._data.ncon:
            self._qpos[:], self._qvel[:] = self._before
            return False
        gliding.end(self._moved, self._moving)
        return True

    def _turned(self) -> FloatArray | None:
        """What makes up for the turning of a rope in the step that begins ``(3 V,)`` [N]."""
        if self._turning is None:
            return None
        back = 1.0 - self._gliding.step / self.time_step
        return self._turning.force(self._before[0][: len(self._moved)], back, self._stretch_damped)

    def _pace(self, step: float, own_damping: float) -> None:
        """Let MuJoCo step by ``step`` [s], and take ``own_damping`` [s] off the damping times of the material."""
        if (step, own_damping) != self._paced:
            self._paced = step, own_damping
            self._model.opt.timestep = step
            self._model.flex_damping[:] = np.maximum(self._damping_times - own_damping, 0.0)
            # a rope's stretch is damped no longer than its bending
            self._stretch_damped = float(self._model.flex_damping.min()) / step

    def _set_stiffness(self, factor: FloatArray | None) -> None:
        """Scale each row of the model's stretch stiffness by the mean of its elements' factors ``(E,)``."""
        self._stretched = factor is not None
        if factor is None:
            self._stretch[:] = self._plain
            return
        if not np.isfinite(factor).all():
            raise RolloutFailed(f"a factor on the stiffness is not finite {self._elapsed:.3f} s after the start")
        mean = np.bincount(self._cells, factor, minlength=len(self._parts)) / self._parts
        np.multiply(self._plain, np.maximum(mean, _SMALLEST_FACTOR)[:, None], out=self._stretch)

    def _contact_forces(self) -> FloatArray:
        """Contact is the only constraint in these models."""
        forces = np.array(self._touch).reshape(-1, 3)
        return forces if self._turn is None else np.asarray(forces @ self._turn.T)

    def close(self) -> None:
        vars(self).clear()  # views into the engine's memory go with the engine
