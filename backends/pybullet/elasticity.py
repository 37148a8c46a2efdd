"""A body's elasticity as seen from here: forces, how short a substep must be, and what damping does."""

import numpy as np

from ...core.arrays import BoolArray, FloatArray
from .elements import Elements

_POWER_ITERATIONS = 60
#: Of the damping solve, relative to where it starts, in the norm of its preconditioner.
_TOLERANCE = 1e-3
_MOST_ITERATIONS = 200


class Elasticity:
    """Stretch or volume elements, and for a sheet its bending.

    Args:
        elements: of the body.
        bending: bending rigidity times the bending matrix ``(V, V)`` [N/m], or None.
    """

    def __init__(self, elements: Elements, bending: FloatArray | None) -> None:
        self._elements = elements
        self._bending = bending
        self._diagonal = elements.diagonal_bound if bending is None else elements.diagonal_bound + np.diag(bending)

    def strain_matrix(self, positions: FloatArray) -> FloatArray:
        """What the other methods need to know of the shape at ``positions (V, 3)`` [m]."""
        return self._elements.strain_matrix(positions)

    def forces(self, matrix: FloatArray, positions: FloatArray) -> FloatArray:
        """Elastic nodal forces ``(V, 3)`` [N] at ``positions (V, 3)`` [m]."""
        forces = self._elements.forces(matrix, positions)
        return forces if self._bending is None else forces - self._bending @ positions

    def stiffness(self, matrix: FloatArray, motion: FloatArray) -> FloatArray:
        """Stiffness K of the present shape times ``motion (V, 3)``."""
        product = self._elements.stiffness(matrix, motion)
        return product if self._bending is None else product + self._bending @ motion

    def fastest(self, positions: FloatArray, masses: FloatArray, free: BoolArray) -> float:
        """Angular frequency [rad/s] of the fastest vibration about ``positions (V, 3)``, by power iteration."""
        matrix = self.strain_matrix(positions)
        root = (free / np.sqrt(masses))[:, None]
        shape = np.random.default_rng(0).normal(size=positions.shape) * free[:, None]
        square = 0.0
        for _ in range(_POWER_ITERATIONS):
            size = float(np.linalg.norm(shape))
            if not size > 0:
                return 0.0
            shape = root * self.stiffness(matrix, root * (shape / size))
            square = float(np.linalg.norm(shape))
        return float(np.sqrt(square))

    def damped(
        self, matrix: FloatArray, velocities: FloatArray, masses: FloatArray, free: BoolArray, time: float
    ) -> FloatArray:
        r"""Velocities ``(V, 3)`` after an implicit step of damping: :math:`(M + \tau K) v' = M v`.

        Implicit, because the explicit limit on a step under C = beta K shrinks with the square of the mesh size.
        Solved by preconditioned conjugate gradients from the velocities themselves.

        Args:
            matrix: strain matrix of the present shape.
            velocities: ``(V, 3)`` [m/s]; those of vertices that are not free stay.
            masses: ``(V,)`` [kg].
            free: which vertices may change ``(V,)``.
            time: tau, damping time times step [s2].
        """
        mask, mass = free[:, None], masses[:, None]
        precondition = mask / (masses + time * self._diagonal)[:, None]
        residual = -time * self.stiffness(matrix, velocities)
        guess = precondition * residual
        direction, product = guess, float(np.vdot(residual, guess))
        goal = _TOLERANCE**2 * product
        result = velocities.copy()
        for _ in range(_MOST_ITERATIONS):
            if not product > goal:
                break
            image = mask * (mass * direction + time * self.stiffness(matrix, direction))
            pace = product / float(np.vdot(direction, image))
            result += pace * direction
            residual = residual - pace * image
            guess = precondition * residual
            last, product = product, float(np.vdot(residual, guess))
            direction = guess + (product / last) * direction
        return result
