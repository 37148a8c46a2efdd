"""How something turns of which only a direction is seen."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.motion import multiply


def carried_turns(directions: FloatArray, start: FloatArray) -> FloatArray:
    """Unit quaternions w x y z ``(T, 4)`` that turn ``start`` into every direction, without a turn about it.

    From ``start`` to the first direction, and from each to the next, by the shortest rotation (Bishop 1975, *There is
    more than one way to frame a curve*).

    Args:
        directions: ``(T, 3)``, of any length above zero.
        start: unit vector ``(3,)``.
    """
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    out = np.empty((len(unit), 4))
    turn, before = np.array([1.0, 0.0, 0.0, 0.0]), start
    for k, now in enumerate(unit):
        turn = multiply(_shortest(before, now), turn)
        out[k] = turn / np.linalg.norm(turn)
        turn, before = out[k], now
    return out


def _shortest(a: FloatArray, b: FloatArray) -> FloatArray:
    """The shortest rotation of unit vector ``a`` to ``b``; of opposite ones about any axis across them."""
    q = np.array([1.0 + a @ b, *np.cross(a, b)])
    if q[0] < 1e-9:
        q = np.array([0.0, *np.cross(a, np.eye(3)[np.argmin(np.abs(a))])])
    return np.asarray(q / np.linalg.norm(q))
