"""The MuJoCo simulator: a flex stepped by the implicit ``discrete`` integrator."""

from collections import deque
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import BrokenPluginError, InputError, RolloutFailed
from ...core.material import ClothMaterial
from ...core.scene import Scene
from ...core.simulator import Simulator, State, World
from .model import mjcf, quadratic_cells

if TYPE_CHECKING:
    import mujoco

#: Inertia of a held vertex relative to the heaviest one. Held vertices are set to their command after
#: every step; the inertia keeps elastic forces from moving them within the step. They yield
#: by h^2 K + h beta K against it: with too little of it, where an object rests depends on its damping.
HELD_INERTIA = 1e6


#: What MuJoCo warned of last; the reason given when a rollout fails.
_WARNINGS: deque[str] = deque(maxlen=1)


def _engine() -> Any:
    try:
        import mujoco
    except ModuleNotFoundError as error:
        if error.name != "mujoco":
            raise
        raise BrokenPluginError(
            "simulator 'mujoco' needs the MuJoCo engine; install it with: pip install 'muslin[mujoco]'"
        ) from error
    if mujoco.get_mju_user_warning() is None:
        # Otherwise MuJoCo prints them and drops a MUJOCO_LOG.TXT into the user's folder.
        mujoco.set_mju_user_warning(_WARNINGS.append)
    return mujoco


class MujocoSimulator(Simulator):
    """MuJoCo 4 flex.

    Cloth is a Saint-Venant-Kirchhoff shell with Kirchhoff bending. A solid that is a regular box with
    odd vertex counts uses quadratic cells whose nodes are the vertices (no shear locking); other
    solids use linear tetrahedra, which are too stiff in bending unless the mesh is fine.

    Args:
        time_step: [s].
    """

    name: ClassVar[str] = "mujoco"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "solid"})
    capabilities: ClassVar[frozenset[str]] = frozenset({"table"})

    def __init__(self, time_step: float = 0.005) -> None:
        if not 0 < time_step <= 0.05:
            raise InputError(f"simulator 'mujoco': time_step must be in (0, 0.05] s, but is {time_step:g}")
        self.time_step = time_step

    def engine_version(self) -> str:
        return f"mujoco {_engine().__version__}"

    def open(self, scene: Scene) -> World:
        return MujocoWorld(scene, self.time_step)


class MujocoWorld(World):
    """One flex. Generalised coordinates are vertex displacements from the start, three a vertex."""

    def __init__(self, scene: Scene, time_step: float) -> None:
        engine = _engine()
        self._step = engine.mj_step
        self.time_step = time_step
        try:
            self._model: mujoco.MjModel = engine.MjModel.from_xml_string(mjcf(scene, time_step))
        except ValueError as error:
            raise RolloutFailed(f"MuJoCo refuses the model: {str(error).splitlines()[0]}") from error
        model = self._model
        count = len(scene.body.vertices)
        if model.nv != 3 * count:
            raise RolloutFailed(f"MuJoCo built {model.nv // 3} nodes for {count} vertices")
        first = model.nbody - count  # vertex bodies come last, in order
        if isinstance(scene.material, ClothMaterial) or quadratic_cells(scene.body) is None:
            model.body_mass[first:] = np.maximum(scene.body.vertex_measures * scene.material.density, 1e-9)
        model.body_mass[first:] += scene.loads
        self.masses: FloatArray = np.array(model.body_mass[first:])
        self._dofs = (3 * scene.held[:, None] + np.arange(3)).ravel()
        model.dof_armature[self._dofs] = HELD_INERTIA * self.masses.max()
        self._data: mujoco.MjData = engine.MjData(model)
        engine.mj_setConst(model, self._data)
        self._rest = scene.body.vertices
        self._rest_held = scene.body.vertices[scene.held].ravel()
        self._loaded = False

    def state(self) -> State:
        return State(self._rest + self._data.qpos.reshape(-1, 3), self._data.qvel.reshape(-1, 3))

    def step(self, held: FloatArray, forces: FloatArray | None, stiffness: FloatArray | None = None) -> None:
        data = self._data
        if forces is not None:
            if not np.isfinite(forces.sum()):  # MuJoCo would leave out the steps and say nothing
                raise RolloutFailed(f"a nodal force is not finite at {data.time:.3f} s")
            data.qfrc_applied[:] = forces.ravel()
            self._loaded = True
        elif self._loaded:
            data.qfrc_applied[:] = 0.0
            self._loaded = False
        target = held.ravel() - self._rest_held
        velocity = (target - data.qpos[self._dofs]) / self.time_step
        data.qvel[self._dofs] = velocity
        self._step(self._model, data)
        data.qpos[self._dofs] = target
        data.qvel[self._dofs] = velocity
        if data.warning.number.any():
            raise RolloutFailed(f"MuJoCo warned at {data.time:.3f} s: {' '.join(_WARNINGS) or 'no text'}")

    def close(self) -> None:
        del self._data, self._model
