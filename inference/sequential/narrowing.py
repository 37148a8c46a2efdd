"""Where the posterior is, as the best fit tells: an ellipsoid that the next round draws from.

A posterior that is learned from a hundred draws of the prior is too wide, the more so the more parameters there are.
Least squares finds where it is, and its curvature how wide, with a few dozen rollouts. Both may deceive: derivatives
may be of chance, a valley may bend, end in a plateau or be one of several. So the ellipsoid is held against the model
before it is drawn from.
"""

from itertools import islice

import numpy as np

from ...core.arrays import BoolArray, FloatArray
from ..polish import MISFIT, PRIOR, Objective, Polished, searches
from .ellipsoid import WIDER, Ellipsoid, inner_radius

#: So often at most axes are turned by what is found at their ends, and then ends are looked for along them.
_TURNS, _LOOKS = 3, 4
#: An end is this much farther out or further in than the last that was tried at most.
_FACTOR = 3.0
#: An end is near enough if the log likelihood falls by no more than this times what it is meant to.
_NEAR_ENOUGH = 4.0
#: From this on a likelihood counts as rugged: the posterior may reach that much farther in -2 log likelihood.
_BUMPY = 1.5
#: So many other places are searched from.
_ELSEWHERE = 2
#: Less than this share of an ellipsoid cannot be drawn from.
_LEAST_SHARE = 1e-3
#: The smallest half axis in the unit cube.
_SMALLEST = 1e-6


def narrowed(objective: Objective, best: Polished, starts: FloatArray, rng: np.random.Generator) -> Ellipsoid | None:
    """The ellipsoid that holds the posterior; None if next to nothing of it lies in the cube.

    Its axes are those of the best fit's covariance, told anew by differences as wide as it is. Their ends are put where
    the model is so much worse that the posterior has ended for sure: where the log likelihood is what
    :data:`~.ellipsoid.WIDER` times the radius of all but a thousandth of a Gaussian would make it, or where the cube
    ends, or nothing can be simulated. Where searches from elsewhere come to what is as good, it is stretched to there.

    Args:
        objective: that ``best`` made least.
        best: the best fit; what it leaves beyond noise makes its covariance, and so the ellipsoid, that much wider.
        starts: draws ``(N, D)``, the one nearest to the measurement first, to look from whether there is more.
        rng: of the volume.
    """
    covariance = best.widened
    for turn in range(_TURNS + 1):
        rays, far = _rays(covariance)
        bound = np.array([_to_the_bound(best.unit, ray) for ray in rays])
        at = np.minimum(far, bound)
        whites = _look(objective, best, rays, at)
        worst = _NEAR_ENOUGH * _meant(best) * (at / np.maximum(far, _SMALLEST)) ** 2
        if turn == _TURNS or all(worse(best, w) < m for w, m in zip(whites, worst, strict=True)):
            break
        covariance = _turned(best, rays, at, whites)
    rugged = _rugged(best, at, whites)
    if rugged > _BUMPY:
        far = np.sqrt(rugged) * far
        at = np.minimum(far, bound)
        whites = _look(objective, best, rays, at)
    ends = _ends(objective, best, rays, at, bound, whites, rugged)
    low, high = _past_cuts(ends.reshape(2, -1), ends.reshape(2, -1) >= bound.reshape(2, -1), far[: len(best.unit)])
    half, axes = np.maximum(0.5 * (low + high), _SMALLEST), rays[len(low) :].T
    ellipsoid = Ellipsoid(best.unit + axes @ (0.5 * (high - low)), axes * half, rng)
    # where there is a misfit, other places were searched from before
    if best.left < MISFIT:
        outside = starts[ellipsoid.out(starts) > 1.0]
        for other in islice(searches(objective, outside, [best.unit]), _ELSEWHERE):
            as_good = worse(best, other.white) < inner_radius(len(best.unit)) ** 2
            if as_good and ellipsoid.out(other.unit[None])[0] > 1.0:
                ellipsoid = ellipsoid.stretched(other.unit, rng)
    return ellipsoid if ellipsoid.share > _LEAST_SHARE else None


def _rays(covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Both directions of every principal axis ``(2 D, D)``, and how far the ellipsoid is meant to reach ``(2 D,)``."""
    values, axes = np.linalg.eigh(covariance)
    far = WIDER * inner_radius(len(values)) * np.sqrt(np.maximum(values, 0.0))
    return np.concatenate([-axes.T, axes.T]), np.concatenate([far, far])


def _rugged(best: Polished, at: FloatArray, whites: list[FloatArray | None]) -> float:
    """How much farther out in -2 log likelihood the posterior may reach, as the best fit may be one for its luck.

    With ``w`` at three points on a line, ``a`` and ``b`` from the middle one, what a linear model makes worse at the
    ends is ``a b |dw / (a + b)|^2`` in the weighted mean. What is more than that the middle owes to bumps of the
    likelihood, or to its bends. A search goes where bumps are kind, and what it pays, the root mean square over the D
    axes, is shared by the D parameters (as in :mod:`..rough_curvature`).

    Args:
        best: the best fit.
        at: distances of the ends of all axes ``(2 D,)``; whites: white residuals there.
    """
    count = len(at) // 2
    lucks = []
    for a, b, below, above in zip(at[:count], at[count:], whites[:count], whites[count:], strict=True):
        if below is not None and above is not None and min(a, b) > 0.0:
            worse_ends = (a * worse(best, above) + b * worse(best, below)) / (a + b)
            by_slope = a * b * float(np.sum((above - below) ** 2)) / (a + b) ** 2
            lucks.append(worse_ends - by_slope / best.excess)
    return 1.0 + float(np.sqrt(np.mean(np.square(lucks)))) / count if lucks else 1.0


def _look(objective: Objective, best: Polished, rays: FloatArray, at: FloatArray) -> list[FloatArray | None]:
    """White residuals at distances ``at (R,)`` from the best fit along ``rays (R, D)``."""
    return objective.many(np.clip(best.unit + at[:, None] * rays, 0.0, 1.0))


def _meant(best: Polished) -> float:
    """How much worse than the best fit an end is meant to be."""
    return (WIDER * inner_radius(len(best.unit))) ** 2


def _turned(best: Polished, rays: FloatArray, at: FloatArray, whites: list[FloatArray | None]) -> FloatArray:
    """The covariance by differences between the ends of the axes of another.

    Where derivatives are of chance, or a valley is narrower between those axes than along them, this shows it.
    """
    count = len(rays) // 2
    slopes = np.zeros((len(best.white), count))
    for k in range(count):
        ends = [(sign * at[i], w) for sign, i in ((-1.0, k), (1.0, count + k)) if (w := whites[i]) is not None]
        (a, below), (b, above) = ends if len(ends) == 2 else [(0.0, best.white), *(ends or [(0.0, best.white)])]
        if b != a:
            slopes[:, k] = (above - below) / (b - a)
    information = slopes.T @ slopes / best.excess + PRIOR * np.eye(count)
    axes = rays[count:].T
    return np.asarray(axes @ np.linalg.inv(information) @ axes.T)


def worse(best: Polished, white: FloatArray | None) -> float:
    """By how much -2 log likelihood is more than at the best fit, what that leaves beyond noise taken for noise."""
    return np.inf if white is None else (float(white @ white) - best.rss) / best.excess


def _ends(
    objective: Objective,
    best: Polished,
    rays: FloatArray,
    at: FloatArray,
    bound: FloatArray,
    whites: list[FloatArray | None],
    rugged: float,
) -> FloatArray:
    """How far the ellipsoid reaches along unit vectors ``(R, D)`` from the best fit ``(R,)``.

    Args:
        objective, best, rays: see :func:`narrowed`.
        at: distances that were looked at ``(R,)``; whites: what was found there.
        bound: where the cube ends ``(R,)``; moved in to where nothing can be simulated.
        rugged: by how much more the log likelihood must fall.
    """
    least, meant = rugged * inner_radius(rays.shape[1]) ** 2, rugged * _meant(best)
    inside, outside, at = np.zeros(len(at)), bound.copy(), at.copy()
    looking = np.flatnonzero(at < bound)
    found = np.array([worse(best, white) for white in whites])[looking]
    for look in range(_LOOKS):
        if look:
            found = np.array([worse(best, white) for white in _look(objective, best, rays[looking], at[looking])])
        ended = (found >= least) & np.isfinite(found)
        bound[looking] = np.where(np.isinf(found), at[looking], bound[looking])  # beyond, nothing can be simulated
        outside[looking] = np.where(ended, at[looking], np.minimum(outside[looking], bound[looking]))
        inside[looking] = np.where(found < least, at[looking], inside[looking])
        # as if the log likelihood were a parabola
        factor = np.sqrt(meant / np.clip(found, meant / _FACTOR**2, meant * _FACTOR**2))
        looking_on = ~ended | (found > _NEAR_ENOUGH * meant)
        at[looking] = np.clip(at[looking] * factor, 1.1 * inside[looking], outside[looking])
        looking = looking[looking_on & (at[looking] < bound[looking])]
        if not len(looking):
            break
    return outside


def _past_cuts(ends: FloatArray, cut: BoolArray, far: FloatArray) -> FloatArray:
    """Both ends of the axes ``(2, D)``, moved out where the cube cuts the posterior off.

    An ellipsoid is thin at its own ends: it reaches as far as on the other side, or as its covariance says where that
    is cut off as well, as all directions are that lead out of a corner. Where the cube cuts off m of the axes, their
    corners lie within the root of m times as far.

    Args:
        ends: found ``(2, D)``; cut: which of them the cube, or what can be simulated, makes ``(2, D)``.
        far: by the covariance ``(D,)``.
    """
    factor = np.sqrt(np.sum(cut.any(axis=0)) - 1.0 + WIDER**2)
    other = np.where(cut[::-1], far, ends[::-1])
    return np.asarray(np.where(cut, np.maximum(factor * ends, other), ends))


def _to_the_bound(unit: FloatArray, ray: FloatArray) -> float:
    """How far it is from ``unit (D,)`` to where the cube ends along ``ray (D,)``."""
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.where(ray > 0, (1.0 - unit) / ray, np.where(ray < 0, -unit / ray, np.inf))
    return float(steps.min())
