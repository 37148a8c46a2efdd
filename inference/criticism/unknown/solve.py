"""The unknown force by regularised output-error estimation: it follows the data, and is no larger than it must be."""

from collections.abc import Sequence

import numpy as np
from scipy import linalg

from ....core.arrays import FloatArray
from ....core.errors import MuslinError
from .estimate import INSIDE, Estimate, ForceObjective, Unknowns

#: Precisions of the smoothest functions that are tried [s4/m2].
PRECISIONS = np.logspace(-5, 4, 37)
#: Shares of a Gauss-Newton step that are tried together.
SHARES = (1.0, 0.5, 0.25, 0.1)
#: Sets of sensitivities at most, and steps with each.
LINEARISATIONS, STEPS = 2, 2
#: A step that gains less than this, as a share of what is left, is the last.
WORTH = 0.02
#: Residuals were linear enough if they are this near to what the sensitivities promised [share of what went away].
LINEAR = 0.1


def estimate_force(objective: ForceObjective, starts: Sequence[FloatArray], centre: FloatArray) -> Estimate:
    """The most probable parameters and forces, by Gauss-Newton steps from the best of ``starts``.

    The prior of a force is normal about zero, its variance falling with the roughness of each function; how
    large it is, is where the evidence of the linearised problem is highest (MacKay 1992, "Bayesian
    interpolation"). Parameters are free within their prior, so that the force has to give only what they cannot.

    Args:
        objective: residuals.
        starts: points ``(D + sum K,)``, the first without any force.
        centre: where the prior of the parameters sits ``(D,)``, in the unit cube.

    Raises:
        MuslinError: none of the starts can be simulated.
    """
    u = objective.unknowns
    starts = [np.concatenate([_inside(p[: len(u.space)]), p[len(u.space) :]]) for p in starts]
    seen = objective.look(starts)
    looked = [(p, s) for p, s in zip(starts, seen, strict=True) if s is not None]
    if not looked or seen[0] is None:
        raise MuslinError("the best fit cannot be simulated on the recordings that it was fitted to; fit again")
    without = sum(float(w @ w) for w in seen[0][0])
    point, (white, paths) = min(looked, key=lambda pair: sum(float(w @ w) for w in pair[1][0]))
    slopes, smooth = objective.slopes(point, white), 1.0
    for linearisation in range(LINEARISATIONS):
        if linearisation:
            slopes = objective.slopes(point, white)
        curved = False
        for _ in range(STEPS):
            scale = max(1.0, sum(float(w @ w) for w in white) / objective.count(white))
            smooth = most_probable(u, slopes, white, point, centre, scale)
            target = solved(u, slopes, white, point, centre, smooth, scale)
            trials = [point + share * (target - point) for share in SHARES]
            for trial in trials:
                trial[: len(u.space)] = _inside(trial[: len(u.space)])
            costs = [_cost(u, smooth, point, centre, white, scale)]
            seen = objective.look(trials)
            for trial, s in zip(trials, seen, strict=True):
                costs.append(np.inf if s is None else _cost(u, smooth, trial, centre, s[0], scale))
            best = int(np.argmin(costs))
            taken = seen[best - 1] if best else None
            if taken is None:
                break
            move = trials[best - 1] - point
            promised = [w + s @ move for w, s in zip(white, slopes, strict=True)]
            off = sum(float(((a - b) ** 2).sum()) for a, b in zip(promised, taken[0], strict=True))
            gone = sum(float(w @ w) for w in white) - sum(float(w @ w) for w in taken[0])
            curved = curved or off > LINEAR * abs(gone)
            point, (white, paths) = trials[best - 1], taken
            if costs[0] - costs[best] < WORTH * costs[best]:
                break
        if not curved:
            break
    return Estimate(u, point, centre, white, slopes, smooth, paths, objective.count(white), without)


def _inside(unit: FloatArray) -> FloatArray:
    return np.clip(unit, INSIDE, 1 - INSIDE)


def _cost(
    u: Unknowns, smooth: float, point: FloatArray, centre: FloatArray, white: list[FloatArray], scale: float
) -> float:
    away = point - _middle(u, centre)
    return float(sum(w @ w for w in white)) / scale + float(u.precisions(smooth) @ away**2)


def _middle(u: Unknowns, centre: FloatArray) -> FloatArray:
    return np.concatenate([centre, np.zeros(u.starts[-1] - len(centre))])


def _normal(
    u: Unknowns, slopes: list[FloatArray], white: list[FloatArray], point: FloatArray, centre: FloatArray, scale: float
) -> tuple[FloatArray, FloatArray, float]:
    """Normal matrix, right-hand side and square of the linearised problem about the middle of the prior."""
    away = point - _middle(u, centre)
    target = [s @ away - w for s, w in zip(slopes, white, strict=True)]
    matrix = sum((s.T @ s for s in slopes), np.zeros((len(point), len(point)))) / scale
    right = sum((s.T @ t for s, t in zip(slopes, target, strict=True)), np.zeros(len(point))) / scale
    return matrix, right, sum(float(t @ t) for t in target) / scale


def solved(
    u: Unknowns,
    slopes: list[FloatArray],
    white: list[FloatArray],
    point: FloatArray,
    centre: FloatArray,
    smooth: float,
    scale: float,
) -> FloatArray:
    """The most probable point of the linearised problem.

    Args:
        u: the unknowns.
        slopes, white: sensitivities and residuals at ``point``, one a recording.
        point: where.
        centre: of the prior of the parameters.
        smooth: precision of the smoothest functions.
        scale: variance of a residual.
    """
    matrix, right, _ = _normal(u, slopes, white, point, centre, scale)
    step = linalg.solve(matrix + np.diag(u.precisions(smooth)), right, assume_a="pos")
    return np.asarray(_middle(u, centre) + step)


def most_probable(
    u: Unknowns, slopes: list[FloatArray], white: list[FloatArray], point: FloatArray, centre: FloatArray, scale: float
) -> float:
    """The precision, of :data:`PRECISIONS`, of highest evidence; arguments as of :func:`solved`."""
    matrix, right, square = _normal(u, slopes, white, point, centre, scale)
    best, chosen = -np.inf, float(PRECISIONS[0])
    for smooth in PRECISIONS.tolist():
        prior = u.precisions(smooth)
        factor = linalg.cho_factor(matrix + np.diag(prior), lower=True)
        misfit = square - float(right @ linalg.cho_solve(factor, right))
        evidence = 0.5 * np.log(prior).sum() - np.log(np.diag(factor[0])).sum() - 0.5 * misfit
        if evidence > best:
            best, chosen = float(evidence), smooth
    return chosen
