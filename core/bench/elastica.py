"""The heavy elastica: how far a strip or rope droops that is held level at one end."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..arrays import FloatArray
from ..errors import RolloutFailed

_STEPS = 300


@dataclass(frozen=True, eq=False)
class Droop:
    """Equilibria of the heavy elastica, by rising load.

    Args:
        load: w L^3 / B ``(N,)`` [1].
        drop: of the tip over L ``(N,)`` [1].
        reach: horizontal distance of the tip over L ``(N,)`` [1].
    """

    load: FloatArray
    drop: FloatArray
    reach: FloatArray


@cache
def heavy_elastica() -> Droop:
    """Solve B theta'' = -w (L - s) cos(theta), theta(0) = 0 at the clamp, theta'(L) = 0 at the tip.

    theta(s) is the slope below the horizontal, w the weight per length, B the bending rigidity (D times
    the width, or EI); Bickley, "The heavy elastica", Phil. Mag. 17 (1934) 603. In the unit of length
    (B / w)^(1/3), measured from the tip, it reads theta'' = -u cos(theta) without a parameter: every slope
    of the tip gives the length U at which theta has come down to zero, by the fourth-order Runge-Kutta
    scheme, and U^3 is the load.
    """
    tip = np.concatenate([np.geomspace(1e-4, 0.2, 300), np.linspace(0.2, 1.5, 1200)[1:]])
    step = np.cbrt(6.0 * tip) / _STEPS
    u, y = np.zeros_like(tip), np.stack([tip, 0 * tip, 0 * tip, 0 * tip])
    out = np.full((4, len(tip)), np.nan)
    while np.isnan(out[0]).any():
        new = _runge_kutta(u, y, step)
        over = np.isnan(out[0]) & (new[0] <= 0)
        if over.any():
            a, b, c = -0.5 * (u * np.cos(y[0]))[over], y[1][over], y[0][over]
            last = np.minimum(2 * c / (-b + np.sqrt(np.maximum(b * b - 4 * a * c, 0.0))), step[over])
            end = _runge_kutta(u[over], y[:, over], last)
            out[:, over] = [u[over] + last, *end[1:]]
        u, y = u + step, new
    length, _, drop, reach = out
    return Droop(length**3, drop / length, reach / length)


def _runge_kutta(u: FloatArray, y: FloatArray, h: FloatArray) -> FloatArray:
    """One step of slope, curvature, drop and reach."""

    def rate(u: FloatArray, y: FloatArray) -> FloatArray:
        return np.stack([y[1], -u * np.cos(y[0]), np.sin(y[0]), np.cos(y[0])])

    a = rate(u, y)
    b = rate(u + h / 2, y + h / 2 * a)
    c = rate(u + h / 2, y + h / 2 * b)
    d = rate(u + h, y + h * c)
    return np.asarray(y + h / 6 * (a + 2 * b + 2 * c + d))


def tip_drop(load: float) -> float:
    """Drop of the tip over the length at ``load`` w L^3 / B [1]; load / 8 where it is small."""
    table = heavy_elastica()
    return load / 8 if load < table.load[0] else float(np.interp(load, table.load, table.drop))


def rigidity(drop: float, length: float, weight: float) -> float:
    """Bending rigidity [N m2, or N m of a strip of unit width] of what droops by ``drop`` [m].

    Args:
        drop: of the tip below the clamp [m].
        length: overhanging [m].
        weight: per length [N/m, or N/m2].

    Raises:
        RolloutFailed: the tip does not droop, or hangs straight down, so that no rigidity follows from it.
    """
    table = heavy_elastica()
    if not 0 < drop / length < table.drop[-1]:
        raise RolloutFailed(f"the tip droops by {drop / length:.3g} of the length, from which no rigidity follows")
    if drop / length < table.drop[0]:
        return weight * length**4 / (8.0 * drop)
    return weight * length**3 / float(np.interp(drop / length, table.drop, table.load))
