"""What effects that act where the object touches an obstacle have in common."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.scene import Scene

#: Gap beyond which nothing touches any more [m].
REACH = 0.002
#: Time constant of the mean normal force [s].
MEMORY = 0.02
#: Stiffness and damping of a bristle times h^2 / m and h / m: well inside what an explicit step of h can carry.
_BRISTLE_STIFFNESS, _BRISTLE_DAMPING = 0.1, 0.5


class Contacts:
    """Where each vertex stands to the obstacles.

    Args:
        scene: with obstacles or without.
    """

    def __init__(self, scene: Scene) -> None:
        self._obstacles, self._radius = scene.obstacles, scene.contact_radius
        #: Coulomb coefficient of the material against every obstacle ``(O,)``.
        self._friction = np.array([scene.material.friction * o.friction for o in scene.obstacles])

    def nearest(self, positions: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gap to the nearest obstacle ``(V,)`` [m], its outward normal ``(V, 3)`` and its friction ``(V,)``."""
        gap, normal = np.full(len(positions), np.inf), np.zeros_like(positions)
        friction = np.zeros(len(positions))
        for obstacle, mu in zip(self._obstacles, self._friction, strict=True):
            distance, outward = obstacle.signed_distance(positions)
            nearer = distance - self._radius < gap
            gap = np.where(nearer, distance - self._radius, gap)
            normal = np.where(nearer[:, None], outward, normal)
            friction = np.where(nearer, mu, friction)
        return gap, normal, friction


def pressing(contact_forces: FloatArray, normal: FloatArray) -> FloatArray:
    """How hard every vertex is pressed against the obstacle ``(V,)`` [N]: the normal part of the contact force."""
    return np.asarray(np.maximum(np.sum(contact_forces * normal, axis=1), 0.0))


class NormalLoad:
    """How hard every vertex has lately been pressed against the obstacle: the mean over :data:`MEMORY`.

    Engines let a vertex that lies on an obstacle hop: pressed twice too hard in one step and not at all in the
    next. The mean is what carries the weight. Beyond :data:`REACH` nothing touches.
    """

    def __init__(self, count: int) -> None:
        self._load = np.zeros(count)
        self._time = np.nan

    def __call__(self, time: float, contact_forces: FloatArray, normal: FloatArray, gap: FloatArray) -> FloatArray:
        """Normal force ``(V,)`` [N]; arguments as elsewhere, for all vertices."""
        step, self._time = time - self._time, time
        fresh = 1.0 - np.exp(-step / MEMORY) if step > 0 else 1.0
        self._load = self._load + fresh * (pressing(contact_forces, normal) - self._load)
        return np.where(gap < REACH, self._load, 0.0)


class Bristles:
    """Friction up to a limit on every vertex, as a spring that yields: it holds still what it can hold.

    The bristle of a vertex is stretched by its sliding, z' = v_t, pulls back with k z + c v_t, and slips as
    soon as k z would exceed the limit (Dahl 1976; Cundall and Strack 1979). What sliding puts in it gives back
    at most. Steady sliding meets the limit, against the motion; at rest it holds up to the limit without
    creeping. k and c follow from mass and step so that an explicit step stays stable, and no force can turn a
    velocity round within a step; the stretch at the limit F is F h^2 / (0.1 m), some tenths of a millimetre.

    Args:
        masses: of the vertices ``(V,)`` [kg].
    """

    def __init__(self, masses: FloatArray) -> None:
        self._masses = masses[:, None]
        self._stretch = np.zeros((len(masses), 3))
        self._time = np.nan

    def __call__(self, time: float, velocities: FloatArray, normal: FloatArray, limit: FloatArray) -> FloatArray:
        """Friction ``(V, 3)`` [N]; none at the first call, as the step is not known yet.

        Args:
            time: [s], later than in the last call.
            velocities: ``(V, 3)`` [m/s].
            normal: of the obstacle ``(V, 3)``.
            limit: of the friction ``(V,)`` [N]; zero where nothing touches.
        """
        step, self._time = time - self._time, time
        if not step > 0:
            return np.zeros_like(velocities)
        sliding = velocities - np.sum(velocities * normal, axis=1, keepdims=True) * normal
        stretch = self._stretch + step * sliding
        stretch = stretch - np.sum(stretch * normal, axis=1, keepdims=True) * normal
        stiffness = _BRISTLE_STIFFNESS * self._masses / step**2
        self._stretch = clipped(stretch, limit[:, None] / stiffness)
        return -clipped(stiffness * self._stretch + _BRISTLE_DAMPING * self._masses / step * sliding, limit[:, None])


def clipped(vectors: FloatArray, longest: FloatArray) -> FloatArray:
    """Vectors ``(V, 3)`` shortened to at most ``longest (V, 1)``."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors * np.minimum(1.0, longest / np.maximum(length, 1e-300)))
