"""How often ``muslin calibrate`` is right about posteriors that are known: false alarms, and faults that it sees.

Parameters are standard normal in probit coordinates and seen through Gaussian noise, so the posterior is known; the
posteriors that are judged are the exact ones, or wrong on purpose. Run: python tests/benchmarks/calibration.py
"""

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "inference"))

from known import exact

from muslin.inference.calibration.ranks import Ranks, rank_cases
from muslin.inference.calibration.verdict import judge
from muslin.inference.posterior.mixture import MixturePosterior

PLACE, WIDTH, PARAMETERS = 0.6, 0.45, 3
PROPOSAL = MixturePosterior(np.ones(1), np.full((1, PARAMETERS), PLACE), WIDTH * np.eye(PARAMETERS)[None])
FAULTS: dict[str, dict[str, float]] = {
    "exact": {},
    "sd x 0.6": {"width": 0.6},
    "sd x 0.8": {"width": 0.8},
    "sd x 1.25": {"width": 1.25},
    "sd x 1.6": {"width": 1.6},
    "shift 0.4 sd": {"shift": 0.4},
    "shift 0.7 sd": {"shift": 0.7},
    "correlation 0.95": {"correlation": 0.95},
}


def ranks_of(cases: str, count: int, wrong: dict[str, float], rng: np.random.Generator) -> Ranks:
    """Ranks of ``count`` cases from the prior, from a mixed proposal with weights, or from a proposal with a tilt."""
    near = PLACE + WIDTH * rng.standard_normal((count, PARAMETERS))
    wide = rng.standard_normal((count, PARAMETERS))
    if cases == "prior":
        return rank_cases(exact(wide, rng, **wrong), rng, draws=200)
    if cases == "proposal, tilted":
        return rank_cases(exact(near, rng, **wrong), rng, draws=200, log_tilt=PROPOSAL.log_prob)
    made = exact(np.where(rng.random((count, 1)) < 0.8, near, wide), rng, **wrong)
    weights = 1 / (0.2 + 0.8 * np.exp(PROPOSAL.log_prob(np.stack([truth for _, truth in made]))))
    return rank_cases(made, rng, draws=200, weights=weights)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=40, help="verdicts a line; five times as many on exact ones")
    parser.add_argument("--cases", type=int, nargs="+", default=[60, 150])
    given = parser.parse_args()
    names = [f"p{k}" for k in range(PARAMETERS)]
    print(f"{'cases':>5}  {'from':<18} {'posterior':<17} verdicts [%]")
    for count in given.cases:
        for cases in ("prior", "proposal, weighted", "proposal, tilted"):
            for fault, wrong in FAULTS.items():
                rng = np.random.default_rng([count, *fault.encode()])
                repeats = given.repeats * (5 if fault == "exact" else 1)
                words = Counter(judge(ranks_of(cases, count, wrong, rng), names, rng).word for _ in range(repeats))
                told = ", ".join(f"{word} {100 * n / repeats:.0f}" for word, n in words.most_common())
                print(f"{count:>5}  {cases:<18} {fault:<17} {told}", flush=True)


if __name__ == "__main__":
    main()
