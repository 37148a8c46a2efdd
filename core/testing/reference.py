"""A small simulator in NumPy, so that effects and the kits can be checked where no engine is installed."""

from typing import ClassVar

import numpy as np

from ..arrays import FloatArray, IntArray
from ..body import Body
from ..material import ClothMaterial, Material, RopeMaterial
from ..scene import Scene
from ..simulator import CAPABILITIES, Simulator, State, World


class ReferenceSimulator(Simulator):
    """Constant-strain elements of Saint-Venant-Kirchhoff material: right in stretch, without bending or torsion.

    Meant for objects of a few dozen vertices: its matrices are dense.

    Args:
        time_step: [s].
    """

    name: ClassVar[str] = "reference"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "rope", "solid"})
    capabilities: ClassVar[frozenset[str]] = frozenset(CAPABILITIES) - {"twist", "uneven-rope"}

    def __init__(self, time_step: float = 0.005) -> None:
        self.time_step = time_step

    def open(self, scene: Scene) -> World:
        return ReferenceWorld(scene, self.time_step)

    def engine_version(self) -> str:
        return "muslin reference"


class ReferenceWorld(World):
    """One mesh of linear segments, triangles or tetrahedra, stepped by linearly implicit Euler.

    Each step solves (M + (h^2 + h beta) K) v' = M v + h f for the new velocities of the free vertices
    (Baraff and Witkin 1998), with K = sum of measure B^T C B without the geometric part, so that it has no
    negative eigenvalue, and f from the Green strain E = (F^T F - 1) / 2 and stress C E of every element.
    Obstacles act on the new velocities, vertex by vertex: the inward part goes, and of the sliding part at
    most mu times as much (Coulomb).
    """

    def __init__(self, scene: Scene, time_step: float) -> None:
        body, material = scene.body, scene.material
        self.time_step = time_step
        self.masses: FloatArray = body.vertex_measures * material.density + scene.loads
        self._elements, self._measures = body.elements, body.measures
        self._gradients = _gradients(body)
        self._dofs = _dofs(body.elements.ravel()).reshape(len(body.elements), -1)
        self._places = (3 * len(self.masses) * self._dofs[:, :, None] + self._dofs[:, None, :]).ravel()
        self._elasticity = _elasticity(material)
        size = self._gradients.shape[2]
        self._pairs = [(a, a) for a in range(size)] + [(a, b) for a in range(size) for b in range(a)]
        self._damping_time = material.damping_time
        self._gravity = scene.gravity
        self._obstacles = [(o, material.friction * o.friction) for o in scene.obstacles]
        self._radius = scene.contact_radius
        self._held = scene.held
        self._free = np.setdiff1d(np.arange(len(self.masses)), scene.held)
        self._free_dofs, self._held_dofs = _dofs(self._free), _dofs(scene.held)
        given = scene.start_velocities
        self._x = scene.start_positions.astype(np.float64)
        self._v = np.zeros_like(body.vertices) if given is None else given.astype(np.float64)
        self._contacts = np.zeros_like(body.vertices)

    def state(self) -> State:
        return State(self._x, self._v, lambda: self._contacts)

    def step(
        self,
        held: FloatArray,
        forces: FloatArray | None,
        stiffness: FloatArray | None = None,
        turns: FloatArray | None = None,
    ) -> None:
        h, free, fixed = self.time_step, self._free_dofs, self._held_dofs
        pull, matrix = self._elastic(stiffness)
        force = pull + (self.masses[:, None] * self._gravity + (0.0 if forces is None else forces)).ravel()
        mass = np.repeat(self.masses, 3)
        matrix = np.diag(mass) + (h * h + h * self._damping_time) * matrix
        right = mass * self._v.ravel() + h * force
        v = np.empty_like(right)
        v[fixed] = ((held - self._x[self._held]) / h).ravel()
        v[free] = np.linalg.solve(matrix[np.ix_(free, free)], (right - matrix[:, fixed] @ v[fixed])[free])
        self._v = v.reshape(-1, 3)
        before, self._x = self._x, self._x + h * self._v
        self._contacts = np.zeros_like(self._v)
        for obstacle, friction in self._obstacles:
            self._touch(before, obstacle.signed_distance(self._x[self._free]), friction)
        self._x[self._held] = held

    def _elastic(self, stiffness: FloatArray | None) -> tuple[FloatArray, FloatArray]:
        """Elastic forces ``(3 V,)`` [N] and the stiffness matrix ``(3 V, 3 V)`` [N/m]."""
        g, count = self._gradients, 3 * len(self.masses)
        f = self._x[self._elements].transpose(0, 2, 1) @ g
        strain = 0.5 * (f.transpose(0, 2, 1) @ f - np.eye(g.shape[2]))
        voigt = np.stack([(1.0 if a == b else 2.0) * strain[:, a, b] for a, b in self._pairs], axis=1)
        outer = g[:, None, :, :, None] * f.transpose(0, 2, 1)[:, :, None, None, :]  # (E, a, i, b, x)
        rows = [outer[:, a, :, b] if a == b else outer[:, a, :, b] + outer[:, b, :, a] for a, b in self._pairs]
        lengthen = np.stack(rows, axis=1).reshape(len(g), len(rows), -1)  # how strains answer to vertices
        weight = self._measures if stiffness is None else self._measures * stiffness
        spread = weight[:, None, None] * (self._elasticity @ lengthen)
        force = np.bincount(self._dofs.ravel(), np.einsum("evn,ev->en", spread, voigt).ravel(), count)
        matrix = np.bincount(self._places, (lengthen.transpose(0, 2, 1) @ spread).ravel(), count * count)
        return np.asarray(-force, np.float64), np.asarray(matrix.reshape(count, count), np.float64)

    def _touch(self, before: FloatArray, found: tuple[FloatArray, FloatArray], friction: float) -> None:
        """Stop and brake the free vertices that would be closer to an obstacle than they may."""
        distance, normal = found
        v = self._v[self._free]
        across = np.sum(v * normal, axis=1)
        push = np.where(distance < self._radius, np.maximum(-across, 0.0), 0.0)
        along = v - across[:, None] * normal
        speed = np.linalg.norm(along, axis=1)
        brake = np.minimum(speed, friction * push) / np.where(speed > 0, speed, 1.0)
        change = push[:, None] * normal - brake[:, None] * along
        self._contacts[self._free] += self.masses[self._free, None] * change / self.time_step
        self._v[self._free] += change
        moved = before[self._free] + self.time_step * self._v[self._free]
        # what had come too close already is put back, which gives it no speed
        late = np.where(push > 0, np.maximum(self._radius - distance - self.time_step * push, 0.0), 0.0)
        self._x[self._free] = moved + late[:, None] * normal


def _dofs(vertices: IntArray) -> IntArray:
    return np.asarray((3 * vertices[:, None] + np.arange(3)).ravel())


def _gradients(body: Body) -> FloatArray:
    """Derivatives ``(E, k, d)`` [1/m] of the k shape functions along the d axes of every element.

    Of a segment along it, of a triangle along its warp and across it, of a tetrahedron along x, y, z.
    """
    corners = body.vertices[body.elements]
    edges = corners[:, 1:] - corners[:, :1]
    if body.kind == "rope":
        axes = edges / body.measures[:, None, None]
    elif body.kind == "cloth":
        warp = body.warp_directions(body.vertices)
        normal = np.cross(edges[:, 0], edges[:, 1])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        axes = np.stack([warp, np.cross(normal, warp)], axis=1)
    else:
        axes = np.broadcast_to(np.eye(3), (len(corners), 3, 3))
    inner = np.linalg.inv(np.einsum("eix,eax->eia", edges, axes)).transpose(0, 2, 1)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)


def _elasticity(material: Material) -> FloatArray:
    """C that gives stresses from strains (normal ones first, then engineering shears), times the cross-section."""
    if isinstance(material, RopeMaterial):
        return np.array([[material.stretch_stiffness]])
    nu = material.poisson_ratio
    if isinstance(material, ClothMaterial):
        s, root = material.stretch_stiffness, np.sqrt(material.weft_stretch_ratio)
        plane = np.array([[1.0 / root, nu], [nu, root]]) * s / (1.0 - nu**2)
        shear = s / (2.0 * (1.0 + nu))
        return np.block([[plane, np.zeros((2, 1))], [np.zeros((1, 2)), np.array([[shear]])]])
    shear = material.youngs_modulus / (2.0 * (1.0 + nu))
    lame = material.youngs_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return np.diag([2 * shear] * 3 + [shear] * 3) + lame * np.outer([1, 1, 1, 0, 0, 0], [1, 1, 1, 0, 0, 0])
