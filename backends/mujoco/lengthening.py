"""A sheet gets longer because a step goes straight on where its edges turn; damping must not hold it so."""

import numpy as np

from ...core.arrays import FloatArray, IntArray

#: Where the packed upper triangle of a triangle's stiffness goes in its matrix, row by row.
_UNPACKED = np.array([0, 1, 2, 1, 3, 4, 2, 4, 5])


class Lengthening:
    r"""Lets a damped sheet spring back from what its edges get longer by as they turn.

    A step is linear in where vertices go. An edge d that changes by :math:`\delta` in it has a squared length that
    changes by :math:`2 d \cdot \delta + \delta^2`, and the step knows of the first part only: with every step an edge
    that turns gets longer by the square of the angle. The elasticity takes that back in the next step, but what damps
    the stretch resists it, as if the sheet were being shortened: the longer it is damped, the longer it stays too long.
    So the damping of just this rate, :math:`-\delta^2` a step, is taken off again where it is longer than a step, in
    the terms of the energy e.M.e / 4 of a triangle (see :mod:`.shell`). What goes to and fro from step to step does not
    count: :math:`\delta` is the mean of the last two.

    No more than that: a sheet that is hardly damped is nearer to chance the nearer it is to the limit of small steps,
    and what a fit seeks is then in one of many valleys.

    Args:
        triangles: of the sheet ``(E, 3)``.
        rest: vertices of the rest shape ``(V, 3)`` [m].
        forms: view of the stretch stiffness of the triangles in the model ``(E, 21)``.
    """

    def __init__(self, triangles: IntArray, rest: FloatArray, forms: FloatArray) -> None:
        opposite = triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
        edges, where = np.unique(np.sort(opposite, axis=1), axis=0, return_inverse=True)
        self._tail, self._head = edges.T
        self._sides, self._count = where.reshape(-1, 3), len(edges)
        self._slots = (3 * edges.T[..., None] + np.arange(3)).ravel()
        self._rest, self._forms = rest[self._head] - rest[self._tail], forms
        self._size = rest.size
        self._offset: FloatArray | None = None
        self._change = np.zeros_like(self._rest)

    def force(self, moved: FloatArray, steps: float) -> FloatArray:
        """Nodal force ``(3 V,)`` [N] for the step that begins now; to be asked for once a step.

        Args:
            moved: displacements from the rest shape ``(V, 3)`` [m].
            steps: damping time that is taken off, in steps.
        """
        offset = moved[self._head] - moved[self._tail]
        change = np.zeros_like(offset) if self._offset is None else offset - self._offset
        mean = 0.5 * (change + self._change)
        grown = np.einsum("ax,ax->a", mean, mean)
        self._offset, self._change = offset, change
        forms = self._forms[:, _UNPACKED].reshape(-1, 3, 3)
        pulls = steps * np.einsum("eab,eb->ea", forms, grown[self._sides])
        pull = np.bincount(self._sides.ravel(), pulls.ravel(), minlength=self._count)[:, None] * (self._rest + offset)
        out = np.bincount(self._slots, np.concatenate([pull, -pull]).ravel(), minlength=self._size)
        return np.asarray(out, np.float64)
