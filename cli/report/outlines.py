"""Obstacles as lines, for pictures of an object among them."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.obstacles import Cylinder, Obstacle, StaticMesh, Table

#: Edges of a mesh are drawn where its surface turns by more than this [rad].
_SHARP = 0.35
_ROUND = 48


def outlines(obstacles: tuple[Obstacle, ...], low: FloatArray, high: FloatArray) -> list[FloatArray]:
    """Lines ``(n, 3)`` [m] around every obstacle; of a table, which has no end, the part below the object.

    Args:
        obstacles: in the world.
        low: corner ``(3,)`` [m] of the box in which the object moves.
        high: the opposite corner ``(3,)`` [m].
    """
    out: list[FloatArray] = []
    for obstacle in obstacles:
        if isinstance(obstacle, Table):
            out.append(_table(obstacle, low, high))
        elif isinstance(obstacle, Cylinder):
            out += _cylinder(obstacle)
        else:
            out += _mesh(obstacle)
    return out


def _table(table: Table, low: FloatArray, high: FloatArray) -> FloatArray:
    margin = 0.1 * float((high - low).max())
    (a, b), (c, d) = low[:2] - margin, high[:2] + margin
    return np.array([[x, y, table.height] for x, y in ((a, b), (c, b), (c, d), (a, d), (a, b))])


def _cylinder(cylinder: Cylinder) -> list[FloatArray]:
    axis = cylinder.direction
    across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    angle = np.linspace(0.0, 2 * np.pi, _ROUND + 1)[:, None]
    ring = cylinder.center + cylinder.radius * (np.cos(angle) * across + np.sin(angle) * np.cross(axis, across))
    reach = 0.5 * cylinder.length * axis
    walls = [np.stack([ring[k] - reach, ring[k] + reach]) for k in range(0, _ROUND, _ROUND // 8)]
    return [ring - reach, ring + reach, *walls]


def _mesh(mesh: StaticMesh) -> list[FloatArray]:
    corners = mesh.vertices[mesh.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    pairs = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(pairs.T)  # every edge has two triangles, which now come one after the other
    edges, sides = pairs[order][::2], (order // 3).reshape(-1, 2)
    turn = np.sum(normal[sides[:, 0]] * normal[sides[:, 1]], axis=1)
    return list(mesh.vertices[edges[turn < np.cos(_SHARP)]])
