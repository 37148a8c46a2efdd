"""Contact: tables are Bullet's, cylinders and meshes are touched here."""

import numpy as np

from ...core.arrays import BoolArray, FloatArray, IntArray
from ...core.obstacles import Cylinder, Obstacle, Table
from .client import Client, address

_TABLE_HALF_EXTENTS = np.array([20.0, 20.0, 1.0])
#: A vertex this near, besides its own radius, is looked at [m].
_WATCH = 0.005
#: Distances to a curved surface are taken anew when a vertex has moved so far [m]; between, the surface is flat.
_FLAT = 0.0003
#: Share of a penetration that is taken back in a substep.
_RECOVERY = 0.2


def add_tables(client: Client, obstacles: tuple[Obstacle, ...], friction: float) -> None:
    """Build the tables in Bullet; the Coulomb coefficient is ``friction`` times their own."""
    for table in obstacles:
        if isinstance(table, Table):
            # A box and not Bullet's plane: soft bodies float 0.1 m above that and creep away from it.
            shape = client.new_shape()
            client.api.b3CreateCollisionShapeAddBox(shape, address(_TABLE_HALF_EXTENTS))
            centre = np.array([0.0, 0.0, table.height - _TABLE_HALF_EXTENTS[2]])
            client.add_fixed(shape, centre, friction * table.friction)


class NodeContact:
    r"""Vertices against one curved obstacle, at the level of velocities.

    A vertex that would be inside at the end of a substep is given the normal velocity that ends it on the surface,
    and Coulomb's law takes away of its tangential velocity what the friction of that push can:
    :math:`\Delta v_t = -\min(\mu\, \Delta v_n, |v_t|)\, v_t / |v_t|`. The obstacle does not move, so masses do not
    matter. Penetration that is there already is taken back slowly and without velocity.

    Bullet's own contact is not used for these: it keeps vertices off a cylinder by a share of the radius and pushes
    them sideways, and of a mesh that is not convex it makes triangles 0.12 m thick.

    Args:
        obstacle: not a table.
        friction: of the object's material.
        radius: how far vertices stay away [m].
        free: which vertices may be moved ``(V,)``.
    """

    def __init__(self, obstacle: Obstacle, friction: float, radius: float, free: BoolArray) -> None:
        self._obstacle, self._mu, self._radius, self._free = obstacle, friction * obstacle.friction, radius, free
        low, high = _bounds(obstacle)
        self._low, self._high = low - radius - _WATCH, high + radius + _WATCH
        self._near: IntArray = np.zeros(0, np.int64)
        self._places = self._normals = np.zeros((0, 3))
        self._distances = np.zeros(0)

    def __call__(self, positions: FloatArray, velocities: FloatArray, time_step: float) -> FloatArray | None:
        """Change ``velocities (V, 3)`` [m/s] in place.

        Returns:
            Shifts ``(V, 3)`` [m] that take back penetration, or None.
        """
        moved = positions + time_step * velocities
        inside = ((moved > self._low) & (moved < self._high)).all(axis=1) & self._free
        if not inside.any():
            return None
        self._look(np.flatnonzero(inside), moved)
        near, normal = self._near, self._normals
        after = self._distances + np.einsum("ij,ij->i", normal, moved[near] - self._places) - self._radius
        if not (after < 0).any():
            return None
        hit = after < 0
        near, normal, after = near[hit], normal[hit], after[hit]
        velocity = velocities[near]
        speed = np.einsum("ij,ij->i", normal, velocity)
        before = after - time_step * speed
        push = np.maximum(np.minimum(0.0, -before / time_step) - speed, 0.0)
        sliding = velocity - speed[:, None] * normal
        rate = np.sqrt(np.einsum("ij,ij->i", sliding, sliding))
        brake = np.minimum(self._mu * push, rate) / np.where(rate > 0, rate, 1.0)
        velocities[near] = velocity + push[:, None] * normal - brake[:, None] * sliding
        if not (before < 0).any():
            return None
        shifts = np.zeros_like(positions)
        shifts[near] = (_RECOVERY * np.maximum(-before, 0.0))[:, None] * normal
        return shifts

    def _look(self, near: IntArray, moved: FloatArray) -> None:
        """Know the surface beside the vertices ``near`` that are now at ``moved (V, 3)``."""
        if np.array_equal(near, self._near):
            apart = moved[near] - self._places
            if np.einsum("ij,ij->i", apart, apart).max() < _FLAT**2:
                return
        self._near, self._places = near, moved[near]
        self._distances, self._normals = self._obstacle.signed_distance(self._places)


def _bounds(obstacle: Obstacle) -> tuple[FloatArray, FloatArray]:
    """The lowest and the highest corner ``(3,)`` of an obstacle."""
    if isinstance(obstacle, Cylinder):
        axis = obstacle.direction
        reach = np.abs(axis) * obstacle.length / 2 + obstacle.radius * np.sqrt(np.maximum(1.0 - axis**2, 0.0))
        return obstacle.center - reach, obstacle.center + reach
    if isinstance(obstacle, Table):
        return np.full(3, -np.inf), np.array([np.inf, np.inf, obstacle.height])
    return obstacle.vertices.min(axis=0), obstacle.vertices.max(axis=0)
