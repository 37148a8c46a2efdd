"""Draws that an estimator did not see, ranked in its posteriors given them."""

from collections.abc import Callable, Iterator

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ...core.estimator import Posterior, PosteriorEstimator
from ..density.training import importance_weights
from .ranks import Ranks, rank_cases

#: Parts into which draws are divided, each left out of a training in turn.
FOLDS = 5
#: Fewer draws of weight above zero than this cannot be divided.
LEAST = 20

MakeEstimator = Callable[[], PosteriorEstimator]


def held_out_ranks(
    make_estimator: MakeEstimator,
    theta: FloatArray,
    x: list[FloatArray],
    log_weights: FloatArray | None,
    seed: int,
    *,
    trainings: int = FOLDS,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Ranks:
    """Train on all draws but a fold, rank those of the fold, and so on.

    With log weights t / p~ the cases are weighted too, so that they follow the density t under which the posteriors
    are learned. The posteriors are those of four fifths of the draws: a little worse than that of all.

    Args:
        make_estimator: builds an untrained estimator.
        theta: ``(N, D)`` in the unit cube.
        x: ``(N, T_r, P, A)`` a recording; NaN = not seen.
        log_weights: ``(N,)`` or None, as for :meth:`~muslin.core.estimator.PosteriorEstimator.fit`.
        seed: of the folds, the trainings and the ranks.
        trainings: folds that are left out in turn, at most :data:`FOLDS`; one is a quick look.
        progress: called with the trainings done and to be done.

    Raises:
        InputError: fewer than :data:`LEAST` draws that count.
    """
    weights = importance_weights(log_weights, len(theta))
    counts = np.flatnonzero(weights > 1e-8)
    if len(counts) < LEAST:
        raise InputError(f"{len(counts)} draws with a weight above zero are too few to leave some out; {LEAST} are not")
    rng = np.random.default_rng([seed, 6007])
    fold = np.full(len(theta), -1)
    fold[rng.permutation(counts)] = np.arange(len(counts)) % FOLDS
    rows = np.concatenate([np.flatnonzero(fold == k) for k in range(trainings)])

    def cases() -> Iterator[tuple[Posterior, FloatArray]]:
        for k in range(trainings):
            progress(k, trainings)
            kept = (fold >= 0) & (fold != k)
            estimator = make_estimator()
            estimator.fit(
                theta[kept],
                [a[kept] for a in x],
                log_weights=None if log_weights is None else log_weights[kept],
                seed=seed + k,
            )
            for i in np.flatnonzero(fold == k):
                # A draw is seen as the measurement is: points that no camera saw are missing in both.
                yield estimator.posterior([a[i] for a in x]), theta[i]

    return rank_cases(cases(), rng, weights=weights[rows])
