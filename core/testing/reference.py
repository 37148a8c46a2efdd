"""A small simulator in NumPy, so that effects can be checked where no engine is installed."""

from typing import ClassVar

import numpy as np

from ..arrays import FloatArray
from ..material import ClothMaterial
from ..scene import Scene
from ..simulator import Simulator, State, World

_STEP = 0.005


class ReferenceSimulator(Simulator):
    """Masses and damped springs along the edges. No bending; a table stops what falls on it."""

    name: ClassVar[str] = "reference"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "solid"})

    def open(self, scene: Scene) -> World:
        return ReferenceWorld(scene)

    def engine_version(self) -> str:
        return "muslin reference"


class ReferenceWorld(World):
    """One spring network, stepped by the linearly implicit Euler scheme of Baraff and Witkin (1998).

    Each step solves (M + (h^2 + h beta) K) v' = M v + h f for the new velocities of the free vertices,
    with K the stiffness of the springs along their present directions: stable for every stiffness.
    """

    def __init__(self, scene: Scene) -> None:
        self.time_step = _STEP
        material = scene.material
        self.masses: FloatArray = scene.body.vertex_measures * material.density + scene.loads
        self._rest = scene.body.edge_lengths(scene.body.vertices)
        if isinstance(material, ClothMaterial):
            self._stiffness = np.full(len(self._rest), material.stretch_stiffness)
        else:
            self._stiffness = material.youngs_modulus * self._rest
        self._a, self._b = scene.body.edges.T
        self._damping_time = material.damping_time
        self._gravity, self._table = scene.gravity, scene.table_height
        self._held = scene.held
        self._held_dofs = (3 * scene.held[:, None] + np.arange(3)).ravel()
        self._free_dofs = np.setdiff1d(np.arange(3 * len(self.masses)), self._held_dofs)
        self._x, self._v = scene.body.vertices.copy(), np.zeros_like(scene.body.vertices)

    def state(self) -> State:
        return State(self._x, self._v)

    def step(self, held: FloatArray, forces: FloatArray | None) -> None:
        h, free, fixed = self.time_step, self._free_dofs, self._held_dofs
        apart = self._x[self._b] - self._x[self._a]
        length = np.linalg.norm(apart, axis=1)
        pull = np.zeros((len(length), len(self._x), 3))  # how each spring's length answers to each vertex
        direction = apart / length[:, None]
        rows = np.arange(len(length))
        pull[rows, self._b], pull[rows, self._a] = direction, -direction
        lengthen = pull.reshape(len(length), -1)
        stiffness = lengthen.T @ (self._stiffness[:, None] * lengthen)
        mass = np.repeat(self.masses, 3)
        outer = self.masses[:, None] * self._gravity + (0.0 if forces is None else forces)
        force = outer.ravel() - lengthen.T @ (self._stiffness * (length - self._rest))
        matrix = np.diag(mass) + (h * h + h * self._damping_time) * stiffness
        right = mass * self._v.ravel() + h * force
        v = np.empty_like(right)
        v[fixed] = ((held - self._x[self._held]) / h).ravel()
        v[free] = np.linalg.solve(matrix[np.ix_(free, free)], (right - matrix[:, fixed] @ v[fixed])[free])
        self._v = v.reshape(-1, 3)
        self._x = self._x + h * self._v
        if self._table is not None:
            below = self._x[:, 2] < self._table
            self._x[below, 2], self._v[below] = self._table, 0.0
        self._x[self._held] = held
