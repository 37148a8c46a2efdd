"""A rope that is known to bend as it should, for the tests of the bench: hinges of moment EI / h times the turn."""

from typing import ClassVar

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.material import RopeMaterial
from muslin.core.scene import Scene
from muslin.core.simulator import Simulator, State, World


class RodSimulator(Simulator):
    """Ropes straight at rest, linearly implicit.

    Args:
        stiffer: factor on the bending rigidity, to make a wrong simulator.
    """

    name: ClassVar[str] = "rod"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"rope"})
    capabilities: ClassVar[frozenset[str]] = frozenset({"start-shape"})

    def __init__(self, stiffer: float = 1.0) -> None:
        self.stiffer = stiffer

    def engine_version(self) -> str:
        return "rod of the tests"

    def open(self, scene: Scene) -> World:
        return RodWorld(scene, self.stiffer)


class RodWorld(World):
    """(M / h + h K) v' = M v / h + f with K of the springs along their present directions and of the hinges.

    The energy of a hinge is EI |x_{i-1} - 2 x_i + x_{i+1}|^2 / 2 h^3, whose Hessian is constant.
    """

    def __init__(self, scene: Scene, stiffer: float) -> None:
        material = scene.material
        assert isinstance(material, RopeMaterial)
        self.time_step = 0.002
        self.masses = scene.body.vertex_measures * material.density + scene.loads
        count, self._rest = len(self.masses), scene.body.measures
        second = np.diff(np.eye(count), 2, axis=0)
        rigid = stiffer * material.bending_rigidity / self._rest.mean() ** 3
        self._bending = np.kron(rigid * second.T @ second, np.eye(3))
        self._ea, self._gravity = material.stretch_stiffness, scene.gravity
        self._held = scene.held
        self._free = np.setdiff1d(np.arange(3 * count), (3 * scene.held[:, None] + np.arange(3)).ravel())
        self._x, self._v = scene.start_positions.copy(), np.zeros((count, 3))

    def state(self) -> State:
        return State(self._x, self._v)

    def step(self, held: FloatArray, forces: FloatArray | None, stiffness: FloatArray | None = None) -> None:
        h, count = self.time_step, len(self.masses)
        edge = np.diff(self._x, axis=0)
        length = np.linalg.norm(edge, axis=1)
        lengthen = np.zeros((count - 1, count, 3))
        rows = np.arange(count - 1)
        lengthen[rows, rows + 1] = edge / length[:, None]
        lengthen[rows, rows] = -edge / length[:, None]
        pull = lengthen.reshape(count - 1, -1)
        force = (self.masses[:, None] * self._gravity).ravel() - self._bending @ self._x.ravel()
        force = force - pull.T @ (self._ea * (length / self._rest - 1))
        if forces is not None:
            force = force + forces.ravel()
        system = h * (self._bending + pull.T @ ((self._ea / self._rest)[:, None] * pull))
        system[np.diag_indices(3 * count)] += np.repeat(self.masses, 3) / h
        right = np.repeat(self.masses, 3) / h * self._v.ravel() + force
        v = np.zeros((count, 3))
        v[self._held] = (held - self._x[self._held]) / h
        right = (right - system @ v.ravel())[self._free]
        flat = v.reshape(-1)
        flat[self._free] = np.linalg.solve(system[np.ix_(self._free, self._free)], right)
        self._v, self._x = v, self._x + h * v
        self._x[self._held] = held
