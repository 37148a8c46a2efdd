"""Least squares by derivatives, where they hold for as far as a step goes.

A rope that is simulated in pieces of a second does not get far from where a piece starts, so what it does is smooth in
its parameters, and a linear model of derivatives leads along valleys that are too narrow and bent for one through
points as far apart as a step is long (:mod:`.secants`). Derivatives are taken anew only where those that Broyden's
update makes of them no longer lead down (Broyden, *A class of methods for solving nonlinear simultaneous equations*,
1965).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..core.arrays import FloatArray
from .secants import BAD, GOOD, LARGEST, LITTLE, RADIUS, Found, Many, linear_step

#: Derivatives ``(N, D)`` at a point ``(D,)`` with its white residuals ``(N,)``.
Derivatives = Callable[[FloatArray, FloatArray], FloatArray]


def descend(
    many: Many,
    derivatives: Derivatives,
    start: Found,
    evaluations: int,
    *,
    enough: float,
    least: float,
    noise: float = 0.0,
    known: bool = False,
) -> tuple[Found, int, bool]:
    """Least squares from ``start`` in the unit cube, how many evaluations it took, and whether it came to rest.

    Args:
        many, derivatives: residuals, and of them.
        start: its derivatives count only if ``known``.
        evaluations: at most, but for the last derivatives.
        enough: it rests where fresh derivatives promise less than this share of the residual sum of squares.
        least: half the side of the smallest box; where they lead nowhere within that, as on a kink, it ends.
        noise: squares that it alone leaves. A step that promises less than :data:`~.secants.LITTLE` of what is left
            beyond is the last.
    """
    at, fresh, holds, used, radius = start, known, known, 0, RADIUS
    while True:
        promised = linear_step(at, LARGEST)[1] if holds else 0.0
        if not fresh and (promised <= enough * at.rss or used >= evaluations):
            at = replace(at, jacobian=derivatives(at.unit, at.white))
            used, fresh = used + len(at.unit), True
            promised = linear_step(at, LARGEST)[1]
        if promised <= enough * at.rss:
            return at, used, True
        if used >= evaluations or radius < least:
            return at, used, False
        last = fresh and promised < LITTLE * (at.rss - noise)
        step, gain = linear_step(at, radius)
        row = many((at.unit + step)[None])[0]
        used += 1
        came_true = -np.inf if row is None or gain <= 0.0 else (at.rss - float(row @ row)) / gain
        if fresh and came_true < GOOD:
            radius = float(np.abs(step).max()) / (1.0 if came_true >= BAD else 4.0)
        if row is not None and came_true > 0.0:
            if came_true >= GOOD:
                radius = min(max(2.0 * float(np.abs(step).max()), radius), LARGEST)
            at, fresh = _updated(at, step, row), False
        if last:
            return at, used, True
        holds = fresh or came_true >= GOOD


def _updated(at: Found, step: FloatArray, row: FloatArray) -> Found:
    """Where ``step (D,)`` leads, with the residuals ``row (N,)``, which the derivatives there explain."""
    off = row - at.white - at.jacobian @ step
    return Found(at.unit + step, row, at.jacobian + np.outer(off, step / (step @ step)))
