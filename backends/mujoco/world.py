"""One flex in MuJoCo, stepped by the implicit ``discrete`` integrator."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import RolloutFailed
from ...core.scene import Scene
from ...core.simulator import State, World
from .engine import WARNINGS, engine
from .model import compiled
from .rod import start_twist

#: The smallest factor on a stiffness: MuJoCo leaves out a flex of which the first number is zero.
_SMALLEST_FACTOR = 1e-9


class MujocoWorld(World):
    """Generalised coordinates are vertex displacements from the rest shape, then the twists of a rope's segments."""

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
        if scene.body.kind == "rope" and scene.start is not None:
            self._qpos[count:] = start_twist(scene.body, scene.start)
        self._commanded = made.commanded
        self._rest_held = self._rest[self._commanded[: 3 * len(scene.held)]]
        self._target = self._qpos[self._commanded]  # a copy
        self._target_held = self._target[: len(self._rest_held)]
        self._positions = np.empty((count // 3, 3))
        self._flat = self._positions.reshape(-1)
        self._velocities = self._qvel[:count].reshape(-1, 3)
        if self._turn is not None:
            self._velocities = np.empty((count // 3, 3))
        self._state = State(self._positions, self._velocities, self._contact_forces if scene.obstacles else None)
        self._loaded = self._stretched = False
        self._stretch, self._cells = made.stretch, made.cells
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

    def step(self, held: FloatArray, forces: FloatArray | None, stiffness: FloatArray | None = None) -> None:
        if forces is not None:
            if not np.isfinite(forces.sum()):  # MuJoCo would leave out the steps and say nothing
                raise RolloutFailed(f"a nodal force is not finite at {self._data.time:.3f} s")
            self._push[:] = self._inward(forces).ravel()
            self._loaded = True
        elif self._loaded:
            self._push[:] = 0.0
            self._loaded = False
        if stiffness is not None or self._stretched:
            self._set_stiffness(stiffness)
        qpos, qvel, commanded = self._qpos, self._qvel, self._commanded
        np.subtract(held.ravel(), self._rest_held, out=self._target_held)
        if self._turn is not None:
            self._target_held[:] = (self._target_held.reshape(-1, 3) @ self._turn).ravel()
        velocity = (self._target - qpos[commanded]) / self.time_step
        qvel[commanded] = velocity
        self._step(self._model, self._data)
        qpos[commanded] = self._target
        qvel[commanded] = velocity
        if np.count_nonzero(self._warnings):
            raise RolloutFailed(f"MuJoCo warned at {self._data.time:.3f} s: {' '.join(WARNINGS) or 'no text'}")

    def _set_stiffness(self, factor: FloatArray | None) -> None:
        """Scale each row of the model's stretch stiffness by the mean of its elements' factors ``(E,)``."""
        self._stretched = factor is not None
        if factor is None:
            self._stretch[:] = self._plain
            return
        if not np.isfinite(factor).all():
            raise RolloutFailed(f"a factor on the stiffness is not finite at {self._data.time:.3f} s")
        mean = np.bincount(self._cells, factor, minlength=len(self._parts)) / self._parts
        np.multiply(self._plain, np.maximum(mean, _SMALLEST_FACTOR)[:, None], out=self._stretch)

    def _contact_forces(self) -> FloatArray:
        """Contact is the only constraint in these models."""
        forces = np.array(self._touch).reshape(-1, 3)
        return forces if self._turn is None else np.asarray(forces @ self._turn.T)

    def close(self) -> None:
        for name in ("state", "qpos", "qvel", "warnings", "moved", "push", "touch", "stretch", "data", "model"):
            delattr(self, f"_{name}")
