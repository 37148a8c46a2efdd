"""A body's elasticity as seen by the world: forces, and how short a substep must be."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ...core.arrays import BoolArray, FloatArray
from .compiled import compiled
from .contact import contact
from .substep import advance, damp

_POWER_ITERATIONS = 60


class Kernels(NamedTuple):
    """What is compiled for one kind of body; ``data`` is its named tuple of arrays."""

    #: ``(data, positions, out)``: elastic nodal forces [N], and remember the shape.
    forces: Callable[[Any, FloatArray, FloatArray], None]
    #: ``(data, motion, out)``: stiffness of the remembered shape times a motion.
    stiffness: Callable[[Any, FloatArray, FloatArray], None]
    #: :func:`fastest`.
    fastest: Callable[[Any, FloatArray, FloatArray, int], float]
    #: :func:`~muslin.backends.pybullet.substep.advance`.
    advance: Callable[..., tuple[int, int]]


@cache
def kernels(kind: str, forces: Callable[..., None], stiffness: Callable[..., None]) -> Kernels:
    """All that is compiled for bodies of ``kind``, whose ``forces`` and ``stiffness`` already are."""
    return Kernels(
        forces,
        stiffness,
        compiled(fastest, kind, stiffness=stiffness),
        compiled(advance, kind, forces=forces, damp=compiled(damp, kind, stiffness=stiffness), contact=contact()),
    )


class Elasticity(ABC):
    """Forces inside a body. It remembers the shape that :meth:`forces` was last asked for."""

    #: Compiled for this kind of body.
    kernels: Kernels
    #: What they work on.
    data: Any
    #: No less than the stiffness of each vertex against its own motion, at rest ``(V,)`` [N/m].
    diagonal: FloatArray

    @abstractmethod
    def scale_stretch(self, factor: FloatArray | None) -> None:
        """From now on multiply the stretch stiffness of every element by ``factor (E,)``; None is one."""

    def forces(self, positions: FloatArray) -> FloatArray:
        """Elastic nodal forces ``(V, 3)`` [N] at ``positions (V, 3)`` [m]."""
        out = np.empty(positions.shape)
        self.kernels.forces(self.data, np.ascontiguousarray(positions), out)
        return out

    def stiffness(self, motion: FloatArray) -> FloatArray:
        """Stiffness of the last shape times ``motion (V, 3)``.

        Only the part of the tangent that comes from strain rates: symmetric, never negative, and zero for
        every rigid motion of that shape, which is what a damping C = beta K needs.
        """
        out = np.empty(motion.shape)
        self.kernels.stiffness(self.data, np.ascontiguousarray(motion), out)
        return out

    def fastest(self, positions: FloatArray, masses: FloatArray, free: BoolArray) -> float:
        """Angular frequency [rad/s] of the fastest vibration about ``positions (V, 3)``, by power iteration."""
        self.forces(positions)
        shape = np.random.default_rng(0).normal(size=positions.shape) * free[:, None]
        return float(np.sqrt(self.kernels.fastest(self.data, free / np.sqrt(masses), shape, _POWER_ITERATIONS)))


def stiffness(data: Any, motion: FloatArray, out: FloatArray) -> None:
    """Stands for the one of the body's kind, which is compiled in."""
    raise NotImplementedError


def fastest(data: Any, root: FloatArray, shape: FloatArray, iterations: int) -> float:
    """Largest eigenvalue [1/s2] of R K R, ``root (V,)`` on the diagonal of R, from ``shape (V, 3)``, which is lost."""
    moved, out = np.empty_like(shape), np.empty_like(shape)
    square = 0.0
    for iteration in range(iterations + 1):
        total = 0.0
        for i in range(len(shape)):
            for k in range(3):
                total += shape[i, k] * shape[i, k]
        square = np.sqrt(total)
        if not square > 0:
            return 0.0
        if iteration == iterations:
            break
        for i in range(len(shape)):
            for k in range(3):
                moved[i, k] = root[i] * (shape[i, k] / square)
        stiffness(data, moved, out)
        for i in range(len(shape)):
            for k in range(3):
                shape[i, k] = root[i] * out[i, k]
    return square
