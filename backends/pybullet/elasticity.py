"""A body's elasticity as seen by the world: forces, how short a substep must be, and what damping does."""

from abc import ABC, abstractmethod

import numpy as np

from ...core.arrays import BoolArray, FloatArray

_POWER_ITERATIONS = 60
#: Of the damping solve, relative to where it starts, in the norm of its preconditioner.
_TOLERANCE = 1e-3
_MOST_ITERATIONS = 200


class Elasticity(ABC):
    """Forces inside a body. It remembers the shape that :meth:`forces` was last asked for."""

    #: No less than the stiffness of each vertex against its own motion, at rest ``(V,)`` [N/m].
    diagonal: FloatArray

    @abstractmethod
    def forces(self, positions: FloatArray) -> FloatArray:
        """Elastic nodal forces ``(V, 3)`` [N] at ``positions (V, 3)`` [m]; a new array."""

    @abstractmethod
    def stiffness(self, motion: FloatArray) -> FloatArray:
        """Stiffness of the last shape times ``motion (V, 3)``; a new array.

        Only the part of the tangent that comes from strain rates: symmetric, never negative, and zero for
        every rigid motion of that shape, which is what a damping C = beta K needs.
        """

    @abstractmethod
    def scale_stretch(self, factor: FloatArray | None) -> None:
        """From now on multiply the stretch stiffness of every element by ``factor (E,)``; None is one."""

    def fastest(self, positions: FloatArray, masses: FloatArray, free: BoolArray) -> float:
        """Angular frequency [rad/s] of the fastest vibration about ``positions (V, 3)``, by power iteration."""
        self.forces(positions)
        root = (free / np.sqrt(masses))[:, None]
        shape = np.random.default_rng(0).normal(size=positions.shape) * free[:, None]
        square = 0.0
        for _ in range(_POWER_ITERATIONS):
            size = float(np.linalg.norm(shape))
            if not size > 0:
                return 0.0
            shape = root * self.stiffness(root * (shape / size))
            square = float(np.linalg.norm(shape))
        return float(np.sqrt(square))

    def damped(self, velocities: FloatArray, masses: FloatArray, free: BoolArray, time: float) -> FloatArray:
        r"""Velocities ``(V, 3)`` after an implicit step of damping: :math:`(M + \tau K) v' = M v`.

        Implicit, because the explicit limit on a step under C = beta K shrinks with the square of the mesh size.
        Solved by preconditioned conjugate gradients from the velocities themselves.

        Args:
            velocities: ``(V, 3)`` [m/s]; those of vertices that are not free stay.
            masses: ``(V,)`` [kg].
            free: which vertices may change ``(V,)``.
            time: tau, damping time times step [s2].
        """
        mask, mass = free[:, None], masses[:, None]
        precondition = mask / (masses + time * self.diagonal)[:, None]
        residual = -time * self.stiffness(velocities)
        guess = precondition * residual
        direction, product = guess, float(np.vdot(residual, guess))
        goal = _TOLERANCE**2 * product
        result = velocities.copy()
        for _ in range(_MOST_ITERATIONS):
            if not product > goal:
                break
            image = mask * (mass * direction + time * self.stiffness(direction))
            pace = product / float(np.vdot(direction, image))
            result += pace * direction
            residual = residual - pace * image
            guess = precondition * residual
            last, product = product, float(np.vdot(residual, guess))
            direction = guess + (product / last) * direction
        return result
