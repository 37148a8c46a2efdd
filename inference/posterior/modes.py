"""The modes of a posterior: where it peaks, and how much of it belongs to each peak."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, minimize
from scipy.spatial import cKDTree

from ...core.arrays import FloatArray, IntArray
from ...core.estimator import Posterior

#: Draws from which the hill is climbed, and the neighbours of a draw to which a step may go.
DRAWS, NEIGHBOURS = 4000, 40
#: Two peaks are one unless the way between them dips this far below the lower [nats].
DIP = 1.0
#: Peaks with less of the mass are none.
LEAST = 0.01
#: The search ends where this share of the draws lies beyond, in each parameter and on either side: towards a face of
#: the cube a density may grow without end where there is hardly any mass.
BEYOND = 0.01


@dataclass(frozen=True, eq=False)
class Mode:
    """A peak of the density on the unit cube, which is the density relative to the prior.

    Args:
        unit: where ``(D,)``, in the unit cube.
        log_prob: natural log density there.
        mass: share of the posterior from which one climbs to this peak.
        centre: mean of that share ``(D,)``; of a posterior that leans on a bound, or says little, nearer to what it
            is about than the peak.
    """

    unit: FloatArray
    log_prob: float
    mass: float
    centre: FloatArray


def modes(posterior: Posterior, *, draws: int = DRAWS, dip: float = DIP, least: float = LEAST) -> list[Mode]:
    """Distinct modes, the one with the most mass first.

    Draws climb from neighbour to neighbour, which follows curved ridges as well; peaks that no dip parts are one
    (Chazal et al. 2013, *Persistence-based clustering in Riemannian manifolds*). The highest draw of each then
    climbs on by itself (L-BFGS).

    Args:
        posterior: on the unit cube.
        draws: from which the hill is climbed.
        dip: see :data:`DIP`.
        least: mass below which a peak is left out.
    """
    samples = posterior.sample(draws, np.random.default_rng(0))
    low, high = np.quantile(samples, [BEYOND, 1.0 - BEYOND], axis=0)
    samples = np.clip(samples, low, high)
    height = posterior.log_prob(samples)
    labels = _peaks(samples / np.maximum(samples.std(axis=0), 1e-12), height, dip)
    found = []
    for peak in np.unique(labels):
        members = samples[labels == peak]
        if len(members) >= least * draws:
            unit, log_prob = _climb(posterior, samples[peak], members.std(axis=0), low, high)
            found.append(Mode(unit, log_prob, len(members) / draws, members.mean(axis=0)))
    return sorted(found, key=lambda m: -m.mass)


def _peaks(points: FloatArray, height: FloatArray, dip: float) -> IntArray:
    """The number of the peak draw ``(N,)`` to which each draw belongs.

    From the highest draw down: one without a higher neighbour is a new peak; others join the peak of their highest
    neighbour; where several peaks meet, those that rise less than ``dip`` above the meeting are taken over.
    """
    near = np.asarray(cKDTree(points).query(points, k=min(NEIGHBOURS, len(points) - 1) + 1)[1])
    near_of: list[set[int]] = [set() for _ in points]
    for i, row in enumerate(near):
        for j in row[1:]:  # neighbours of each other, whichever of the two counts the other among its nearest
            near_of[i].add(int(j))
            near_of[int(j)].add(i)
    parent = np.full(len(points), -1)

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = int(parent[i])
        return i

    for i in np.argsort(-height):
        higher = [j for j in near_of[i] if parent[j] >= 0]
        if not higher:
            parent[i] = i
            continue
        top = max((root(j) for j in higher), key=lambda r: height[r])
        parent[i] = root(max(higher, key=lambda j: height[j]))
        for other in {root(j) for j in higher} - {top}:
            if height[other] - height[i] < dip:
                parent[other] = top
    return np.array([root(i) for i in range(len(points))])


def _climb(
    posterior: Posterior, start: FloatArray, scale: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, float]:
    """The top that is reached from ``start`` within the bounds, and its log density."""
    scale = np.maximum(scale, 1e-9)
    step = 1e-4 * np.eye(len(start))

    def downhill(w: FloatArray) -> tuple[float, FloatArray]:
        places = np.clip(np.vstack([w, w + step, w - step]) * scale, 0.0, 1.0)
        value = -posterior.log_prob(places)
        up, down = (places[1 : len(w) + 1], value[1 : len(w) + 1]), (places[len(w) + 1 :], value[len(w) + 1 :])
        return float(value[0]), (up[1] - down[1]) / (np.diagonal(up[0] - down[0]) / scale)

    bounds = Bounds(low / scale, high / scale)
    done = minimize(downhill, start / scale, jac=True, method="L-BFGS-B", bounds=bounds)
    best = np.clip(done.x * scale, low, high)
    heights = posterior.log_prob(np.stack([best, start]))
    return (best, float(heights[0])) if heights[0] >= heights[1] else (start, float(heights[1]))
