"""Tables, which are Bullet's."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import RolloutFailed
from ...core.obstacles import Obstacle, Table
from .client import Client, address

_TABLE_HALF_EXTENTS = np.array([20.0, 20.0, 1.0])
#: A position [m] or velocity [m/s] beyond this is a blow-up.
_FARTHEST = 1e4
#: A vertex that would end a substep this near, besides its own radius, is given to Bullet [m].
_WATCH = 1e-6
#: A vertex that is deeper inside than this is brought out again; less is rounding [m].
_DEEP = 1e-12
#: Nodes of the smallest of Bullet's worlds; each next one has twice as many.
_FEWEST = 8


class Tables:
    """Bullet's tables, and as many of its nodes as vertices touch one.

    A contact of one vertex has nothing to do with any other vertex, and with nothing that was before. Bullet is
    therefore given those vertices only that would come to lie inside within the substep; for all others the
    step is ``x += v dt`` there too. As its time goes with the nodes there are, not with those that touch, it has
    several worlds, from few nodes to all, each made when first needed.

    Tables do not move, so what Bullet does to a velocity is right whatever the mass.

    Args:
        obstacles: of which the tables are taken.
        friction: of the object's material.
        radius: how far vertices stay away [m].
        most: vertices that can touch at a time.
    """

    def __init__(self, obstacles: tuple[Obstacle, ...], friction: float, radius: float, most: int) -> None:
        self._tables = [o for o in obstacles if isinstance(o, Table)]
        self._friction, self._radius, self._most = friction, radius, most
        self._worlds: dict[int, Client] = {}
        self._surface = max((t.height for t in self._tables), default=-np.inf) + radius
        #: A vertex that would end a substep lower than this is Bullet's [m].
        self.reach = self._surface + _WATCH

    def step(self, x: FloatArray, v: FloatArray, time: float) -> tuple[FloatArray, FloatArray]:
        """Positions [m] and velocities [m/s] ``time`` [s] after ``x (N, 3)`` and ``v (N, 3)``.

        Besides contact, Bullet takes penetration that is there already back bit by bit, without velocity; only
        then is a position not ``x + v dt``.

        Raises:
            RolloutFailed: a vertex is not finite, or too far or fast; Bullet's trees of boxes would not survive it.
        """
        if not (np.abs(x).max() < _FARTHEST and np.abs(v).max() < _FARTHEST):
            raise RolloutFailed("a vertex is not finite, or farther away or faster than anything real")
        world = self._world(len(x))
        world.set_time_step(time)
        world.set_positions(x)
        world.set_velocities(v)
        world.step()
        v = world.velocities(len(x))
        return (world.positions(len(x)) if x[:, 2].min() < self._surface - _DEEP else x + time * v), v

    def _world(self, count: int) -> Client:
        """The smallest world with ``count`` nodes."""
        nodes = _FEWEST
        while nodes < count:
            nodes *= 2
        nodes = min(nodes, self._most)
        if nodes not in self._worlds:
            client = self._worlds[nodes] = Client()
            for table in self._tables:
                # A box and not Bullet's plane: soft bodies float 0.1 m above that and creep away from it.
                shape = client.new_shape()
                client.api.b3CreateCollisionShapeAddBox(shape, address(_TABLE_HALF_EXTENTS))
                centre = np.array([0.0, 0.0, table.height - _TABLE_HALF_EXTENTS[2]])
                client.add_fixed(shape, centre, self._friction * table.friction)
            client.load(nodes, self._radius)
        return self._worlds[nodes]

    def close(self) -> None:
        """Free the worlds."""
        for client in self._worlds.values():
            client.close()
