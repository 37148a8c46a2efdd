"""How far data let parameters move where chance moves the model: differences wide enough to see past it.

A rope on a table answers to next to nothing in its parameters. Derivatives by small differences are of that chance
there, so large that every parameter seems known to a ten-thousandth of its range; and the least square lies where
chance is kind, not where the parameters are right.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..core.arrays import FloatArray
from .polish import PRIOR, Objective, Polished

#: Half-widths of central differences in the unit cube, tried from the first on.
WIDTHS = (0.002, 0.008, 0.032, 0.1)
#: A difference tells a slope if its square is this many times what chance makes of it.
CLEAR = 4.0


@dataclass(frozen=True, eq=False)
class _Difference:
    """A central difference along one parameter.

    Args:
        slope: of the white residuals ``(N,)``.
        chance: what chance adds to its square, in the mean.
        luck: how much less the square sum is in the middle than around it, but for the slope [noise variances].
    """

    slope: FloatArray
    chance: float
    luck: float

    @property
    def clear(self) -> bool:
        return float(self.slope @ self.slope) >= CLEAR * self.chance


def seen_past_chance(objective: Objective, best: Polished) -> Polished:
    """The same fit with a covariance that holds where the model cannot be repeated; where it can, it is as it was.

    With ``w(x)`` at three points, ``d = w(x + h) - w(x - h)`` and ``e = w(x + h) + w(x - h) - 2 w(x)``, chance ``c`` of
    each point adds ``2 |c|^2`` to ``|d|^2`` and ``6 |c|^2`` to ``|e|^2``: a third of the latter is taken off the
    former, and ``h`` grows until little is to be taken off (Moré and Wild, *Estimating derivatives of noisy
    simulations*, 2012). The square sum then is a parabola and chance on top, which shows in ``w e + |e|^2 / 4``, by
    how much the neighbours leave more than a parabola would. A search goes where that is least, as far from the bottom
    of the parabola as it pays. What it pays, the root mean square of it, is shared by the D parameters, so the
    covariance grows by a D-th of that.

    Args:
        objective: that was made least.
        best: where, its derivatives by one-sided differences over the step of the objective's discrepancy.
    """
    discrepancy = objective.discrepancy
    chance = 2.0 * discrepancy.left_to_chance(objective.recordings) / discrepancy.step**2
    if bool((np.sum(best.jacobian**2, axis=0) >= CLEAR * chance).all()):
        return best
    found = [list(_wider_and_wider(objective, best, k)) for k in range(len(best.unit))]
    if not all(found):  # next to it nothing can be simulated, so there is nothing better than the derivatives
        return best
    jacobian = np.stack([differences[-1].slope for differences in found], axis=1)
    information = jacobian.T @ jacobian - np.diag([differences[-1].chance for differences in found])
    values, vectors = np.linalg.eigh(information)
    # the uniform prior of a unit interval has variance 1/12
    covariance = (vectors / (np.maximum(values, 0.0) + PRIOR)) @ vectors.T
    luck = float(np.sqrt(np.mean([differences[0].luck ** 2 for differences in found])))
    grown = 1.0 + luck / len(best.unit)
    told = grown * covariance
    scale = np.sqrt(np.minimum(1.0, 1.0 / PRIOR / np.diag(told)))  # no less is known than the prior says
    return replace(best, covariance=np.asarray(told * np.outer(scale, scale), float), grown=grown)


def _wider_and_wider(objective: Objective, best: Polished, k: int) -> Iterator[_Difference]:
    """Along parameter ``k``, until one is clear; none more where the model cannot be simulated."""
    for width in WIDTHS:
        made = _difference(objective, best, k, width)
        if made is None:
            return
        yield made
        if made.clear:
            return


def _difference(objective: Objective, best: Polished, k: int, width: float) -> _Difference | None:
    """Along parameter ``k``; None where the model cannot be simulated."""
    center = best.unit.copy()
    center[k] = np.clip(center[k], width, 1.0 - width)
    step = width * np.eye(len(center))[k]
    points = [center - step, center + step, *([] if np.array_equal(center, best.unit) else [center])]
    rows = objective.many(np.stack(points))
    whole = [row for row in rows if row is not None]
    if len(whole) < len(rows):
        return None
    below, above = whole[:2]
    middle = whole[2] if len(whole) > 2 else best.white
    bend = above + below - 2.0 * middle
    return _Difference(
        slope=(above - below) / (2.0 * width),
        chance=float(bend @ bend) / 3.0 / (2.0 * width) ** 2,
        luck=float(middle @ bend + bend @ bend / 4.0),
    )
