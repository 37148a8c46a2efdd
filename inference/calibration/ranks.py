"""Where known parameters lie in the posteriors given their own simulations: uniformly, if these are calibrated."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ...core.arrays import FloatArray
from ...core.estimator import Posterior

#: Draws of each posterior among which the truth is ranked.
DRAWS = 500

#: Natural log of proposal over prior ``(N,)`` at points ``(N, D)`` of the unit cube.
LogTilt = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Ranks:
    """Numbers between 0 and 1, one row a case; uniform, each column, where posteriors are calibrated.

    Args:
        parameter: ``(N, D)``, the share of each marginal below the truth (simulation-based calibration, Talts et al.
            2018, arXiv:1804.06788).
        region: ``(N,)``, the mass of the highest-density region on whose border the truth lies (expected coverage,
            Hermans et al. 2022, arXiv:2110.06581); above 0.8 for more than a fifth where 80 % regions are too small.
        tarp: ``(N,)``, the mass that is nearer than the truth to a random point (Lemos et al. 2023,
            arXiv:2302.03026).
        weights: ``(N,)``, what each case counts; their mean is one.
    """

    parameter: FloatArray
    region: FloatArray
    tarp: FloatArray
    weights: FloatArray

    @property
    def effective(self) -> float:
        """How many cases of equal weight these are worth (Kish)."""
        return float(self.weights.sum() ** 2 / (self.weights**2).sum())


def rank_cases(
    cases: Iterable[tuple[Posterior, FloatArray]],
    rng: np.random.Generator,
    *,
    weights: FloatArray | None = None,
    log_tilt: LogTilt | None = None,
    draws: int = DRAWS,
) -> Ranks:
    """Rank the truth of each case in its posterior.

    Cases that come from the prior are ranked as they are. Cases from a proposal can be handled in two ways. Weighted
    by prior over proposal, they stand for the prior again, so calibration is judged over all of the prior's box. With
    ``log_tilt`` each posterior is turned into the one under the proposal as prior, its draws weighted by proposal
    over prior; the truth then ranks uniformly over the cases as they come, so calibration is judged where the
    proposal lies, which is near the measurement (with the posterior itself as proposal: Säilynoja et al. 2025,
    arXiv:2502.03279).

    Args:
        cases: posterior given a simulation, and the parameters ``(D,)`` that it was simulated with.
        rng: of the draws, the random points, and the places within a rank.
        weights: ``(N,)`` of the cases; equal if None.
        log_tilt: see above; None ranks in the posteriors as they are.
        draws: of each posterior.
    """
    rows = [_rank(posterior, np.asarray(truth, float), rng, log_tilt, draws) for posterior, truth in cases]
    parameter, region, tarp = (np.array([row[k] for row in rows]) for k in range(3))
    weights = np.ones(len(rows)) if weights is None else np.asarray(weights, float)
    return Ranks(parameter, region, tarp, weights / weights.mean())


def _rank(
    posterior: Posterior, truth: FloatArray, rng: np.random.Generator, log_tilt: LogTilt | None, draws: int
) -> tuple[FloatArray, float, float]:
    samples = posterior.sample(draws, rng)
    density = posterior.log_prob(np.vstack([samples, truth]))
    mass = np.ones(draws)
    if log_tilt is not None:
        tilt = log_tilt(np.vstack([samples, truth]))
        density = density + tilt
        mass = np.exp(tilt[:-1] - tilt[:-1].max())
    mass /= mass.sum()
    scale = samples.std(axis=0) + 1e-12
    spot = rng.random(len(truth))
    far = (((np.vstack([samples, truth]) - spot) / scale) ** 2).sum(axis=1)
    # A rank among S draws can take S + 1 places; a random place within it makes it a number from the unit interval.
    # Of weighted draws, as many count as they are worth.
    step = float((mass**2).sum())

    def place(below: FloatArray) -> FloatArray:
        return np.asarray((mass @ below + step * rng.random(below.shape[1:])) / (1.0 + step))

    return (
        place((samples < truth).astype(float)),
        float(place((density[:-1] > density[-1]).astype(float))),
        float(place((far[:-1] < far[-1]).astype(float))),
    )
