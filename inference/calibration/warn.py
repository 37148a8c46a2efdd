"""A quick look at the calibration of a fit that has just ended."""

from collections.abc import Sequence

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import InputError
from .held_out import MakeEstimator, held_out_ranks
from .verdict import TOGETHER, judge, off

#: Probability of a warning about a calibrated posterior.
FALSE_ALARMS = 0.01


def calibration_warnings(
    make_estimator: MakeEstimator,
    theta: FloatArray,
    x: list[FloatArray],
    log_weights: FloatArray | None,
    seed: int,
    names: Sequence[str],
) -> list[str]:
    """Sentences for people where posteriors promise more than they hold; empty otherwise.

    One more training, on four fifths of the draws; the others are ranked in its posteriors. A posterior that is too
    wide is safe and needs no warning.

    Args:
        make_estimator: builds an untrained estimator.
        theta, x, log_weights: what the estimator was trained on last.
        seed: of all that is random.
        names: of the parameters.
    """
    try:
        ranks = held_out_ranks(make_estimator, theta, x, log_weights, seed, trainings=1)
    except InputError:  # too few draws to leave some out
        return []
    verdict = judge(ranks, names, np.random.default_rng([seed, 6011]), FALSE_ALARMS)
    said = []
    for row in verdict.rows:
        where = "" if row.name == TOGETHER else f" in {row.name}"
        if row.finding == "over-confident":
            said.append(
                f"the posterior is over-confident{where}: on draws that it was not trained on, what should hold the "
                f"truth 80 times in 100 holds it {100 * row.held:.0f} times; muslin calibrate looks closer, more "
                "draws ([estimator] draws) or another estimator mend it"
            )
        elif row.finding == "biased":
            said.append(
                f"the posterior is biased{where}: on draws that it was not trained on, the truth lies "
                f"{off(row)}; muslin calibrate looks closer"
            )
    return said
