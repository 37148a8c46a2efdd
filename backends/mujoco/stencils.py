"""Any constant stiffness matrix as bending of a MuJoCo flex.

MuJoCo's bending of a triangle mesh is a sum of constant 4 x 4 matrices, one for every inner edge, between its two
ends and the two corners opposite; ``mjModel.flex_bending`` holds them, and the ``discrete`` integrator takes
all of them implicitly. Two triangles that share an edge can be made of any four vertices, so a second
flex on the same vertices, which neither stretches nor collides, can carry any symmetric matrix.
"""

from itertools import combinations

import numpy as np

from ...core.arrays import FloatArray, IntArray


def quadruples(matrix: FloatArray, points: FloatArray) -> IntArray:
    """Sets of four vertices ``(N, 4)`` that hold every pair that ``matrix (V, V)`` couples, greedily few.

    The first two are the shared edge, chosen so that both triangles have an area at ``points (V, 3)``, as
    MuJoCo's compiler demands.
    """
    coupled = matrix != 0.0
    np.fill_diagonal(coupled, False)
    near = [set(np.flatnonzero(row).tolist()) for row in coupled]
    left = [set(n) for n in near]
    found = []
    for first in range(len(near)):
        while left[first]:
            chosen, fresh, pool = [first], set(left[first]), set(near[first])
            while len(chosen) < 4:
                if fresh:
                    new = min(fresh)
                else:  # no vertex is new to all chosen ones: the one that is new to most
                    pool = pool or set(range(len(near))) - set(chosen)
                    new = max(pool, key=lambda v: (sum(v in left[k] for k in chosen), -v))
                chosen.append(new)
                fresh = (fresh & left[new]) - set(chosen)
                pool = (pool & near[new]) - set(chosen)
            for a, b in combinations(chosen, 2):
                left[a].discard(b)
                left[b].discard(a)
            found.append(chosen)
    return _ordered(np.array(found, dtype=np.int64).reshape(-1, 4), points)


def _ordered(sets: IntArray, points: FloatArray) -> IntArray:
    """The same sets, with that pair first on which the smaller triangle is largest."""
    orders = np.array([[*pair, *(k for k in range(4) if k not in pair)] for pair in combinations(range(4), 2)])
    candidates = sets[:, orders]
    p = points[candidates]
    edge = p[:, :, 1] - p[:, :, 0]
    areas = [np.linalg.norm(np.cross(edge, p[:, :, k] - p[:, :, 0]), axis=2) for k in (2, 3)]
    best = np.argmax(np.minimum(*areas), axis=1)
    return np.asarray(candidates[np.arange(len(sets)), best])


def spread(matrix: FloatArray, sets: IntArray) -> FloatArray:
    """Shares ``(N, 4, 4)`` of ``matrix (V, V)``, for each set its rows and columns, that add up to it."""
    rows, columns = sets[:, :, None], sets[:, None, :]
    uses = np.zeros(matrix.shape)
    np.add.at(uses, (rows, columns), 1.0)
    return np.asarray(matrix[rows, columns] / uses[rows, columns])
