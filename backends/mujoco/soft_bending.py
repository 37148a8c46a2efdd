"""Bending of cloth that is soft enough to be a force outside MuJoCo."""

import numpy as np

from ...core.arrays import FloatArray, IntArray

#: Largest step times angular frequency of bending at which it is left out of MuJoCo's implicit solve; the scheme below
#: is stable to 2. And the largest step times rate of decay.
_LARGEST_PHASE, _LARGEST_DECAY = 1.0, 0.5


def is_soft(bending: FloatArray, masses: FloatArray, held: IntArray, time_step: float, damping_time: float) -> bool:
    """Whether bending may be explicit.

    Inside MuJoCo it joins vertices that are far apart, and makes the matrix that is factored at every step four times
    dearer. The fastest frequency is taken at most at the largest row sum of ``M^-1/2 B M^-1/2``.

    Args:
        bending: the matrix B ``(V, V)`` [N/m] of the force -B x.
        masses: of the vertices ``(V,)`` [kg].
        held: vertices ``(H,)`` that do not yield.
        time_step: [s].
        damping_time: of the material [s].
    """
    root = 1.0 / np.sqrt(np.maximum(masses, 1e-12))
    root[held] = 0.0
    fastest = float((np.abs(bending) @ root * root).max(initial=0.0))
    return fastest * time_step**2 <= _LARGEST_PHASE**2 and fastest * damping_time * time_step / 2 <= _LARGEST_DECAY


class SoftBending:
    """The force of bending ``-B (x + (c + beta) v)``.

    A step of MuJoCo takes x to x + tau V, and is thrown on from there to the whole step h. With c = h - tau a mode of
    frequency w is multiplied by a matrix of determinant (1 - h c w^2) (1 - h tau w^2) + h w^2 (h - h tau c w^2) = 1:
    it neither grows nor decays. For tau = h it is symplectic Euler. beta damps as it does the rest of the material.

    Args:
        matrix: B ``(V, V)`` [N/m].
        damping_time: beta [s].
    """

    def __init__(self, matrix: FloatArray, damping_time: float) -> None:
        self._matrix = matrix
        self._damping_time = damping_time
        self._ahead = np.empty((len(matrix), 3))
        self._force = np.empty((len(matrix), 3))

    def __call__(self, moved: FloatArray, velocities: FloatArray, ahead: float) -> FloatArray:
        """The force taken off a step's forces ``(3 V,)`` [N]; valid until the next call.

        Args:
            moved: displacements ``(3 V,)`` [m].
            velocities: ``(3 V,)`` [m/s].
            ahead: c [s].
        """
        flat = self._ahead.reshape(-1)
        np.multiply(velocities, ahead + self._damping_time, out=flat)
        flat += moved
        np.matmul(self._matrix, self._ahead, out=self._force)
        return self._force.reshape(-1)
