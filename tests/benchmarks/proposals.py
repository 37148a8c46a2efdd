"""Which proposals find a known posterior with the fewest draws: exact posteriors on a grid, the same draws a round.

``curved``: a simulator that bends both of its parameters; ``bimodal``: one that cannot tell a parameter from its
mirror image; ``linear``: one that a single regression over the whole box learns at once. Printed: the divergence
KL(exact || learned) [nats] after every round, the median over seeds, and how often the Gaussian division failed::

    python tests/benchmarks/proposals.py --seeds 2
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from muslin.core.estimator import Posterior
from muslin.inference.estimators.bayessim_rkhs import BayesSimRKHS
from muslin.inference.sequential.proposals import Proposals

Model = Callable[[np.ndarray, np.ndarray], np.ndarray]
CELLS = 1200
#: Two observed numbers or three of two parameters in the unit square, and their noise.
CASES: dict[str, tuple[Model, float]] = {
    "curved": (lambda a, b: np.stack([np.exp(2 * a) * (0.5 + b), np.sin(5 * a + 2 * b), 2 * a * b], -1), 0.02),
    "bimodal": (lambda a, b: np.stack([(2 * a - 1) ** 2, b + 0.3 * a], -1), 0.03),
    "linear": (lambda a, b: np.stack([a + 0.5 * b, b - 0.2 * a], -1), 0.01),
}


def simulate(case: str, theta: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    model, noise = CASES[case]
    clean = model(theta[:, 0], theta[:, 1])
    return (clean + noise * rng.standard_normal(clean.shape))[:, None, :, None]


def divergence(case: str, x: np.ndarray, posterior: Posterior, rng: np.random.Generator) -> float:
    """KL(exact || learned) from 4000 draws of the exact posterior."""
    model, noise = CASES[case]
    middle = (np.arange(CELLS) + 0.5) / CELLS
    a, b = np.meshgrid(middle, middle, indexing="ij")
    log_l = -0.5 * ((x[0, :, 0] - model(a, b)) ** 2).sum(axis=-1) / noise**2
    mass = np.exp(log_l - log_l.max()).ravel()
    mass /= mass.sum()
    cell = rng.choice(len(mass), 4000, p=mass)
    draws = np.stack([a.ravel()[cell], b.ravel()[cell]], axis=1) + (rng.random((4000, 2)) - 0.5) / CELLS
    return float(np.mean(np.log(mass[cell] * CELLS**2) - posterior.log_prob(draws)))


def rounds(case: str, kind: str, seed: int, count: int, per_round: int) -> tuple[list[float], int]:
    """The divergence after each round, and the rounds that were learned anew; ``kind`` "prior" has one proposal."""
    x = simulate(case, 0.25 + 0.5 * np.random.default_rng([seed, 0]).random((1, 2)), np.random.default_rng([seed, 1]))[
        0
    ]
    proposals = Proposals("posterior" if kind == "prior" else kind, 2, seed)  # type: ignore[arg-type]
    theta, seen, out, redone = np.zeros((0, 2)), np.zeros((0, *x.shape)), [], 0
    for k in range(count):
        draws = (
            np.random.default_rng([seed, k]).random((per_round, 2)) if kind == "prior" else proposals.draw(per_round)
        )
        theta = np.concatenate([theta, draws])
        seen = np.concatenate([seen, simulate(case, draws, np.random.default_rng([seed, k, 3]))])
        estimator = BayesSimRKHS()
        estimator.fit(
            theta, [seen], log_weights=None if kind == "prior" else proposals.log_weights(theta), seed=seed + k
        )
        posterior = estimator.posterior([x]) if kind == "prior" else proposals.corrected(estimator.posterior([x]))
        if posterior is None:
            redone += 1
            estimator.fit(theta, [seen], log_weights=proposals.log_weights(theta, under_prior=True), seed=seed + k)
            posterior = estimator.posterior([x])
        out.append(divergence(case, x, posterior, np.random.default_rng([seed, 4])))
        if kind != "prior":
            proposals.add(posterior, theta, np.zeros(len(theta), bool))
    return out, redone


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--draws", type=int, default=200, help="a round")
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=list(CASES))
    parser.add_argument("--kinds", nargs="+", default=["prior", "truncated", "posterior", "gaussian"])
    args = parser.parse_args()
    for case in args.cases:
        for kind in args.kinds:
            began = time.monotonic()
            runs = [rounds(case, kind, seed, args.rounds, args.draws) for seed in range(args.seeds)]
            after = np.median([r[0] for r in runs], axis=0)
            print(
                f"{case:8} {kind:10} KL after each round {' '.join(f'{v:6.2f}' for v in after)}; "
                f"{sum(r[1] for r in runs)} divisions failed; {time.monotonic() - began:.0f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
