"""A small simulator in NumPy, so that effects can be checked where no engine is installed."""

from typing import ClassVar

import numpy as np

from ..arrays import FloatArray
from ..body import Body
from ..material import ClothMaterial, Material, RopeMaterial
from ..scene import Scene
from ..simulator import CAPABILITIES, Simulator, State, World

_STEP = 0.005


class ReferenceSimulator(Simulator):
    """Masses and damped springs along the edges. No bending; obstacles stop what falls on them, without friction."""

    name: ClassVar[str] = "reference"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "rope", "solid"})
    capabilities: ClassVar[frozenset[str]] = frozenset(CAPABILITIES) - {"twist"}

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
        self._stiffness = _spring_stiffness(scene.body, material)
        self._a, self._b = scene.body.edges.T
        self._damping_time = material.damping_time
        self._gravity, self._obstacles = scene.gravity, scene.obstacles
        self._radius = scene.contact_radius
        self._sharing = _shares(scene.body)
        self._contacts = np.zeros_like(scene.body.vertices)
        self._held = scene.held
        self._held_dofs = (3 * scene.held[:, None] + np.arange(3)).ravel()
        self._free_dofs = np.setdiff1d(np.arange(3 * len(self.masses)), self._held_dofs)
        self._x, self._v = scene.start_positions.copy(), np.zeros_like(scene.body.vertices)

    def state(self) -> State:
        return State(self._x, self._v, lambda: self._contacts)

    def step(self, held: FloatArray, forces: FloatArray | None, stiffness: FloatArray | None = None) -> None:
        h, free, fixed = self.time_step, self._free_dofs, self._held_dofs
        apart = self._x[self._b] - self._x[self._a]
        length = np.linalg.norm(apart, axis=1)
        pull = np.zeros((len(length), len(self._x), 3))  # how each spring's length answers to each vertex
        direction = apart / length[:, None]
        rows = np.arange(len(length))
        pull[rows, self._b], pull[rows, self._a] = direction, -direction
        lengthen = pull.reshape(len(length), -1)
        spring = self._stiffness if stiffness is None else self._stiffness * (self._sharing @ stiffness)
        matrix = lengthen.T @ (spring[:, None] * lengthen)
        mass = np.repeat(self.masses, 3)
        outer = self.masses[:, None] * self._gravity + (0.0 if forces is None else forces)
        force = outer.ravel() - lengthen.T @ (spring * (length - self._rest))
        matrix = np.diag(mass) + (h * h + h * self._damping_time) * matrix
        right = mass * self._v.ravel() + h * force
        v = np.empty_like(right)
        v[fixed] = ((held - self._x[self._held]) / h).ravel()
        v[free] = np.linalg.solve(matrix[np.ix_(free, free)], (right - matrix[:, fixed] @ v[fixed])[free])
        self._v = v.reshape(-1, 3)
        self._x = self._x + h * self._v
        self._contacts = np.zeros_like(self._v)
        for obstacle in self._obstacles:
            distance, normal = obstacle.signed_distance(self._x)
            inward = np.minimum(np.sum(self._v * normal, axis=1), 0.0)
            stopped = np.where((distance < self._radius)[:, None], -inward[:, None] * normal, 0.0)
            self._contacts += self.masses[:, None] * stopped / h
            self._v = self._v + stopped
            self._x = self._x + np.maximum(self._radius - distance, 0.0)[:, None] * normal
        self._x[self._held] = held


def _spring_stiffness(body: Body, material: Material) -> FloatArray:
    """Stiffness of the springs along the edges ``(N,)`` [N/m], roughly."""
    rest = body.edge_lengths(body.vertices)
    if isinstance(material, RopeMaterial):
        return np.asarray(material.stretch_stiffness / rest)
    if not isinstance(material, ClothMaterial):
        return np.asarray(material.youngs_modulus * rest)
    along = (body.vertices[body.edges[:, 1]] - body.vertices[body.edges[:, 0]]) / rest[:, None]
    shares = _shares(body)
    warp = np.abs(np.sum(along * (shares @ body.warp_directions(body.vertices)), axis=1))
    return np.asarray(material.stretch_stiffness * material.weft_stretch_ratio ** (0.5 - warp**2))


def _shares(body: Body) -> FloatArray:
    """Weights ``(N, E)`` that give a mean over the elements at every edge."""
    inside = np.array([[np.isin(edge, element).all() for element in body.elements] for edge in body.edges], float)
    return np.asarray(inside / inside.sum(axis=1, keepdims=True))
