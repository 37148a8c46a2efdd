"""What an object pulls at a grasp, from the strain of the elements next to it."""

import numpy as np

from ...core.arrays import FloatArray, IntArray, dot
from ...core.bending import bending_of
from ...core.material import ClothMaterial, RopeMaterial
from ...core.scene import Scene
from .crease import bending_rigidity
from .stretch import rest_shape

#: How points move along and, per arm, about the axes x, y, z: the identity, and -e_ijk with the arm first.
_ALONG = np.eye(3)
_ABOUT = np.cross(_ALONG[None, :], _ALONG[:, None]).swapaxes(1, 2).reshape(3, 9)


class GripLoad:
    """Force and torque of the object on one gripper, and how they fall when the grasp gives way.

    The elements that touch the grasp are Saint Venant-Kirchhoff triangles of the scene's material, or segments of a
    rope; its bending (:class:`BendingPull`, which all grasps share) and the weight of the held vertices come on top.
    Their inertia is left out.

    Args:
        scene: of cloth or rope.
        masses: of the vertices ``(V,)`` [kg].
        held: vertices of the grasp ``(H,)``.
    """

    def __init__(self, scene: Scene, masses: FloatArray, held: IntArray) -> None:
        self._held = held
        self._weight = masses[held, None] * scene.gravity
        inside = np.isin(scene.body.elements, held)
        near = inside.any(axis=1)
        self._elements, inside = scene.body.elements[near], inside[near]
        rows = np.zeros(len(masses), np.int64)
        rows[held] = np.arange(len(held))
        self._rows, self._inside = rows[self._elements], inside[..., None, None].astype(float)
        self._measures = scene.body.measures[near]
        material, body = scene.material, scene.body
        self._rope = isinstance(material, RopeMaterial)
        if isinstance(material, RopeMaterial):
            self._bends = _stiffest_motions(scene, held, bending_rigidity(scene))
            self._moduli = np.array([[material.stretch_stiffness]])
        else:
            assert isinstance(material, ClothMaterial)
            self._moduli = _plane_stress(material)
            along = body.warp_directions(body.vertices)[near]
            self._inverse = rest_shape(body.vertices[self._elements], along)
        springs = self._moduli.max() / (self._measures if self._rope else 1.0)
        heaviest = np.where(inside, 0.0, masses[self._elements]).max(axis=1)
        self._answer = 2.0 * np.sqrt(heaviest / springs)

    def __call__(
        self, positions: FloatArray, step: float, bent: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Load and stiffness of the grasp, when its vertices are at those of ``positions (V, 3)`` [m].

        An element whose free vertex of mass m answers faster than the step h, at sqrt(k / m) > 2 / h, resists as
        its wave impedance sqrt(k m) does: 2 sqrt(k m) / h instead of k.

        Args:
            positions: of all vertices [m].
            step: h [s].
            bent: forces of the bending on all vertices ``(V, 3)`` [N], for a rope.

        Returns:
            Force and torque about the centre of the grasp ``(6,)`` [N, N m], and by how much they fall per
            displacement and turn of it within ``step`` [s] ``(6, 6)``.
        """
        points = positions[self._held]
        motions = _motions(points - points.sum(axis=0) / len(points))
        corners = positions[self._elements]
        moves = self._inside * motions[self._rows]
        strain, rates = self._segments(corners, moves) if self._rope else self._triangles(corners, moves)
        weighted = self._measures[:, None, None] * (self._moduli @ rates)
        force = -np.einsum("ek,ekm->m", strain, weighted)
        weighted *= np.minimum(1.0, self._answer / step)[:, None, None]
        stiffness = rates.reshape(-1, 6).T @ weighted.reshape(-1, 6)
        outer = self._weight
        if self._rope:
            assert bent is not None
            outer = outer + bent[self._held]
            stiffness = stiffness + self._bends
        return force + np.einsum("hx,hxm->m", outer, motions), stiffness

    def _segments(self, corners: FloatArray, moves: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Strain ``(E, 1)`` and how it answers to the motions of the grasp ``(E, 1, 6)``."""
        apart = corners[:, 1] - corners[:, 0]
        length = np.sqrt(dot(apart, apart))
        rates = np.einsum("ex,exm->em", apart / (length * self._measures)[:, None], moves[:, 1] - moves[:, 0])
        return (length / self._measures - 1.0)[:, None], rates[:, None]

    def _triangles(self, corners: FloatArray, moves: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Green strain xx, yy, 2 xy ``(E, 3)`` along warp and weft, and its answer to the motions ``(E, 3, 6)``."""
        edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
        turned = np.stack([moves[:, 1] - moves[:, 0], moves[:, 2] - moves[:, 0]], axis=2)
        shape = edges @ self._inverse
        (x, y), (dx, dy) = shape.transpose(2, 0, 1), np.einsum("exim,eij->jexm", turned, self._inverse)
        strain = 0.5 * np.stack([dot(x, x) - 1.0, dot(y, y) - 1.0, 2.0 * dot(x, y)], axis=1)
        rates = [np.einsum("ex,exm->em", a, b) for a, b in ((x, dx), (y, dy), (x, dy), (y, dx))]
        return strain, np.stack([rates[0], rates[1], rates[2] + rates[3]], axis=1)


class BendingPull:
    """Nodal forces of the bending of a rope, followed from where it starts.

    Args:
        scene: of a rope.
    """

    def __init__(self, scene: Scene) -> None:
        self._bending, self._rigidity = bending_of(scene.body, scene.held), bending_rigidity(scene)
        self._bending.follow(scene.start_positions)

    def __call__(self, positions: FloatArray) -> FloatArray:
        """Forces ``(V, 3)`` [N] on the vertices, which are now at ``positions (V, 3)`` [m]."""
        self._bending.follow(positions)
        return self._bending.forces(self._rigidity * (self._bending.curvature - self._bending.rest))


def _motions(arms: FloatArray) -> FloatArray:
    """How vertices at ``arms (H, 3)`` from the centre of a grasp move with it ``(H, 3, 6)``: along, about x, y, z."""
    out = np.empty((len(arms), 3, 6))
    out[:, :, :3] = _ALONG
    out[:, :, 3:] = (arms @ _ABOUT).reshape(-1, 3, 3)
    return out


def _plane_stress(material: ClothMaterial) -> FloatArray:
    """Moduli ``(3, 3)`` [N/m] of xx, yy and 2 xy, x along the warp."""
    s, nu, root = material.stretch_stiffness, material.poisson_ratio, np.sqrt(material.weft_stretch_ratio)
    across = 1.0 - nu * nu
    return np.array(
        [
            [s / root / across, nu * s / across, 0.0],
            [nu * s / across, s * root / across, 0.0],
            [0.0, 0.0, s / 2 / (1 + nu)],
        ]
    )


def _stiffest_motions(scene: Scene, held: IntArray, rigidity: FloatArray) -> FloatArray:
    """Bending stiffness ``(6, 6)`` of a rope against the motions of a grasp, no less than in any direction."""
    body = scene.body
    bending, points = bending_of(body, scene.held), body.vertices[held]
    rates = []
    for motion in _motions(points - points.mean(axis=0)).transpose(2, 0, 1):
        velocities = np.zeros_like(body.vertices)
        velocities[held] = motion
        rates.append((np.sqrt(bending.measures[:, None] * rigidity) * bending.rates(velocities)).ravel())
    matrix = np.array(rates) @ np.array(rates).T
    most = [np.linalg.eigvalsh(matrix[part, part])[-1] for part in (slice(0, 3), slice(3, 6))]
    return np.diag(np.repeat(most, 3))
