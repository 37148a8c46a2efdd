"""Substeps of a body in machine code: forces, kick, damping, contact, and on to the next place."""

from typing import Any, NamedTuple

import numpy as np

from ...core.arrays import BoolArray, FloatArray, IntArray
from .contact import Surfaces

#: Of the damping solve, relative to no damping, in the norm of its preconditioner.
_TOLERANCE = 1e-3
_MOST_ITERATIONS = 200


class Matter(NamedTuple):
    """What does not change: masses ``(V,)`` [kg], which vertices are free ``(V,)`` and which are held ``(H,)``."""

    masses: FloatArray
    free: BoolArray
    held: IntArray


class Drive(NamedTuple):
    """What is the same in all substeps of a step.

    Args:
        time: of a substep [s].
        substeps: how many.
        push: nodal forces and weight ``(V, 3)`` [N].
        pull: velocities of the held vertices ``(H, 3)`` [m/s].
        damping: damping time times substep, tau [s2].
        precondition: of the damping solve ``(V,)`` [1/kg], zero for held vertices.
        reach: a vertex lower than this is left to Bullet [m].
    """

    time: float
    substeps: int
    push: FloatArray
    pull: FloatArray
    damping: float
    precondition: FloatArray
    reach: float


def forces(data: Any, positions: FloatArray, out: FloatArray) -> None:
    """Stands for the one of the body's kind, which is compiled in."""
    raise NotImplementedError


def stiffness(data: Any, motion: FloatArray, out: FloatArray) -> None:
    """Stands for the one of the body's kind, which is compiled in."""
    raise NotImplementedError


def contact(surfaces: Surfaces, free: BoolArray, time: float, x: FloatArray, v: FloatArray, shift: FloatArray) -> None:
    """Stands for :func:`~muslin.backends.pybullet.contact.touch`, compiled."""
    raise NotImplementedError


def advance(
    data: Any,
    matter: Matter,
    surfaces: Surfaces,
    drive: Drive,
    x: FloatArray,
    v: FloatArray,
    shift: FloatArray,
    pushed: FloatArray,
    past: FloatArray,
    near: IntArray,
    first: int,
) -> tuple[int, int]:
    """Substeps from ``first`` on, until one brings a vertex into reach of a table.

    Args:
        data: of the elasticity.
        matter: masses and what is held.
        surfaces: that are touched here.
        drive: of this step.
        x: positions ``(V, 3)`` [m], changed in place.
        v: velocities ``(V, 3)`` [m/s], changed in place.
        shift: ``(V, 3)`` [m], set to what takes back penetration in the last substep.
        pushed: ``(V, 3)`` [m/s], to which is added what contact does to the velocities.
        past: ``(2, V, 3)`` [m/s], what :func:`damp` remembers.
        near: ``(V,)``, set to which vertices are Bullet's in the last substep: they have not moved in it.
        first: substep to begin with.

    Returns:
        The substep to go on with, and how many vertices are in ``near``.
    """
    count, dt = len(x), drive.time
    force, before = np.empty_like(x), np.empty_like(x)
    touching = len(surfaces.friction) > 0
    for substep in range(first, drive.substeps):
        forces(data, x, force)
        for i in range(count):
            pace = dt / matter.masses[i]
            for k in range(3):
                v[i, k] += pace * (force[i, k] + drive.push[i, k])
        for i, vertex in enumerate(matter.held):
            v[vertex] = drive.pull[i]
        if drive.damping > 0:
            damp(data, matter, drive, v, past)
        if touching:
            before[:] = v
            shift[:] = 0.0
            contact(surfaces, matter.free, dt, x, v, shift)
            pushed += v - before
        waiting = 0
        for i in range(count):
            # Not the other way round, so that what is not a number comes to light there.
            if matter.free[i] and not x[i, 2] + dt * v[i, 2] >= drive.reach:
                near[waiting] = i
                waiting += 1
            else:
                for k in range(3):
                    x[i, k] += dt * v[i, k] + shift[i, k]
        if waiting > 0:
            return substep + 1, waiting
    return drive.substeps, 0


def damp(data: Any, matter: Matter, drive: Drive, v: FloatArray, past: FloatArray) -> None:
    r"""Change velocities ``(V, 3)`` by an implicit step of damping: :math:`(M + \tau K) v' = M v`.

    Implicit, because the explicit limit on a step under C = beta K shrinks with the square of the mesh size.
    Solved by preconditioned conjugate gradients. They start from what the two substeps before changed, ``past
    (2, V, 3)`` [m/s], continued in a straight line, or from nothing where that is nearer; while nothing hits the
    body an iteration or two is then enough.
    """
    tau, count = drive.damping, len(v)
    residual, direction, image, before = np.empty_like(v), np.empty_like(v), np.empty_like(v), v.copy()
    stiffness(data, v, image)
    cold = 0.0
    for i in range(count):
        for k in range(3):
            residual[i, k] = -tau * image[i, k]
            cold += residual[i, k] * residual[i, k] * drive.precondition[i]
            v[i, k] += 2.0 * past[0, i, k] - past[1, i, k]
    stiffness(data, v, image)
    product = 0.0
    for i in range(count):
        for k in range(3):
            image[i, k] = matter.masses[i] * (before[i, k] - v[i, k]) - tau * image[i, k]
            product += image[i, k] * image[i, k] * drive.precondition[i]
    if product < cold:
        residual[:] = image
    else:
        product = cold
        v[:] = before
    for i in range(count):
        for k in range(3):
            direction[i, k] = drive.precondition[i] * residual[i, k]
    for _ in range(_MOST_ITERATIONS):
        if not product > _TOLERANCE**2 * cold:
            break
        stiffness(data, direction, image)
        curvature = 0.0
        for i in range(count):
            for k in range(3):
                image[i, k] = matter.masses[i] * direction[i, k] + tau * image[i, k]
                curvature += direction[i, k] * image[i, k]
        pace, last, product = product / curvature, product, 0.0
        for i in range(count):
            for k in range(3):
                v[i, k] += pace * direction[i, k]
                residual[i, k] -= pace * image[i, k]
                product += residual[i, k] * residual[i, k] * drive.precondition[i]
        for i in range(count):
            for k in range(3):
                direction[i, k] = drive.precondition[i] * residual[i, k] + product / last * direction[i, k]
    past[1] = past[0]
    past[0] = v - before
