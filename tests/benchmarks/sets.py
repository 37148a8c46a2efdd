"""Do kernel mean embeddings keep what networks that read points by their place lose? Known posteriors over sets.

Two simulators whose posterior is known exactly, on a grid:

- *keypoints*: four keypoints in each of eight frames, moved by two parameters, jittered, a tenth of them dropped, and
  in each frame shuffled with some probability, from 0 to 1. The exact posterior sums over all 24 orders.
- *sizes*: 1 to 64 points of a normal whose centre and spread are the parameters. A mean of features forgets how many
  there were; the layer's log n and 1/sqrt(n) bring it back.

The score is the mean log posterior density at the true parameters; 0 is the prior's::

    make bench-sets
"""

import argparse
import itertools
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import logsumexp
from table import RESULTS, Row, report

from muslin.core.arrays import FloatArray
from muslin.core.registry import REGISTRY

SHUFFLED = (0.0, 0.25, 0.5, 1.0)
FRAMES, POINTS, JITTER, DROPPED = 8, 4, 0.2, 0.1
LARGEST = 64
_ORDERS = np.array(list(itertools.permutations(range(POINTS))))
_SIDE = 40
_GRID = np.stack(np.meshgrid(*[(np.arange(_SIDE) + 0.5) / _SIDE] * 2, indexing="ij"), axis=-1).reshape(-1, 2)


@dataclass(frozen=True)
class Method:
    """An estimator as it enters the table."""

    label: str
    name: str
    options: tuple[tuple[str, Any], ...] = ()


RKHS = (Method("bayessim-rkhs", "bayessim-rkhs"), Method("npe-rkhs", "npe-rkhs"))
BY_PLACE = (
    Method("bayessim-mdnn", "bayessim-mdnn", (("sort", False),)),
    Method("bayessim-mdrff", "bayessim-mdrff", (("sort", False),)),
)
SORTED = Method("bayessim-mdnn, sorted", "bayessim-mdnn")
SIZES = (
    Method("with log n and 1/sqrt(n)", "bayessim-rkhs"),
    Method("mean alone", "bayessim-rkhs", (("size", False),)),
)


def keypoints(theta: FloatArray) -> FloatArray:
    """``(N, T, K, 2)`` where the keypoints are: a strip that swings (first parameter) and ripples (second)."""
    t = np.linspace(0.0, 1.0, FRAMES)[:, None]
    k = np.arange(POINTS)[None, :]
    swing, ripple = theta[:, 0, None, None], theta[:, 1, None, None]
    along = 0.25 * k + 0.5 * swing * np.sin(2.0 * t + 0.6 * k)
    across = 0.4 * np.sin((1.0 + ripple) * (3.0 * t + 0.8 * k)) * (0.5 + swing)
    return np.stack([along, across], axis=-1)


def shuffled_keypoints(theta: FloatArray, probability: float, rng: np.random.Generator) -> FloatArray:
    """Keypoints jittered, dropped (NaN) and, frame by frame with this probability, in random order."""
    x = keypoints(theta)
    x = x + JITTER * rng.standard_normal(x.shape)
    x[rng.random(x.shape[:3]) < DROPPED] = np.nan
    orders = rng.random(x.shape[:3]).argsort(axis=2)
    stays = rng.random(x.shape[:2]) >= probability
    order = np.where(stays[..., None], np.arange(POINTS), orders)
    return np.take_along_axis(x, order[..., None], axis=2)


def exact_keypoints(row: FloatArray, probability: float, theta: FloatArray) -> FloatArray:
    """``(G,)`` log likelihood of one trajectory ``(T, K, 2)`` on parameters ``(G, 2)``, up to a constant."""
    where = keypoints(theta)
    seen = np.isfinite(row).all(axis=2)
    gap = np.where(seen[..., None], row, 0.0)[None, :, :, None, :] - where[:, :, None, :, :]
    # What slot i of a frame says of keypoint k: (G, T, K, K).
    each = np.where(seen[None, :, :, None], -0.5 * (gap**2).sum(axis=-1) / JITTER**2, 0.0)
    slots = np.arange(POINTS)
    orders = np.stack([each[:, :, slots, o].sum(axis=-1) for o in _ORDERS])
    # The order in which they come is the first, and holds with 1 - probability beside its share of the rest.
    share = np.full(len(_ORDERS), probability / len(_ORDERS))
    share[0] += 1.0 - probability
    top = orders.max(axis=0)
    mixed = np.tensordot(share, np.exp(orders - top), axes=1)
    return np.asarray((top + np.log(np.maximum(mixed, 1e-300))).sum(axis=1))


def _normal(theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    return theta[:, 0], np.exp(np.log(0.05) + theta[:, 1] * np.log(20.0))


def sized_sets(theta: FloatArray, rng: np.random.Generator) -> FloatArray:
    """``(N, 1, 64, 1)``: as many points as were drawn (log-uniform from 1 to 64), the rest NaN."""
    centre, spread = _normal(theta)
    x = centre[:, None] + spread[:, None] * rng.standard_normal((len(theta), LARGEST))
    counts = np.floor(np.exp(rng.random(len(theta)) * np.log(LARGEST + 1.0)))
    x[np.arange(LARGEST) >= counts[:, None]] = np.nan
    return x[:, None, :, None]


def exact_sizes(row: FloatArray, theta: FloatArray) -> FloatArray:
    """``(G,)`` log likelihood of one set ``(1, 64, 1)``, up to a constant."""
    centre, spread = _normal(theta)
    points = row[np.isfinite(row)]
    return np.asarray(
        -0.5 * (((points - centre[:, None]) / spread[:, None]) ** 2).sum(1) - len(points) * np.log(spread)
    )


def exact_score(likelihood: Callable[[FloatArray, FloatArray], FloatArray], theta: FloatArray, x: FloatArray) -> float:
    """Mean log density of the exact posterior at the true parameters; its integral is a sum over a grid."""
    scores = []
    for truth, row in zip(theta, x, strict=True):
        total = logsumexp(likelihood(row, _GRID)) - np.log(len(_GRID))
        scores.append(float(likelihood(row, truth[None])[0] - total))
    return float(np.mean(scores))


def _simulate(probability: float | None, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    theta = rng.random((count, 2))
    return theta, sized_sets(theta, rng) if probability is None else shuffled_keypoints(theta, probability, rng)


def score(method: Method, probability: float | None, draws: int, cases: int, seed: int) -> tuple[float, float]:
    """Mean log density at the truth of fresh cases, and the seconds of the fit; probability None is *sizes*."""
    theta, x = _simulate(probability, draws, 2 * seed)
    estimator = REGISTRY.get("estimator", method.name)(correspondence=False, **dict(method.options))
    began = time.process_time()
    estimator.fit(theta, [x], seed=seed)
    seconds = time.process_time() - began
    truth, fresh = _simulate(probability, cases, 2 * seed + 1)
    scores = [estimator.posterior([row]).log_prob(t[None])[0] for t, row in zip(truth, fresh, strict=True)]
    return float(np.mean(scores)), seconds


def exact(probability: float | None, cases: int, seed: int) -> float:
    """The exact posterior's score on the cases of :func:`score`."""
    truth, fresh = _simulate(probability, cases, 2 * seed + 1)
    if probability is None:
        return exact_score(exact_sizes, truth, fresh)
    return exact_score(lambda row, grid: exact_keypoints(row, probability, grid), truth, fresh)


def plot(found: dict[str, FloatArray], best: FloatArray, path: Path) -> None:
    """Score against probability, mean and range over seeds; ``found`` and ``best`` are ``(probabilities, seeds)``."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6, 4), layout="constrained")
    for label, values in {"exact posterior": best, **found}.items():
        style = {"color": "black", "linestyle": "--"} if label == "exact posterior" else {"marker": "o"}
        (line,) = axes.plot(SHUFFLED, values.mean(axis=1), label=label, **style)
        axes.fill_between(SHUFFLED, values.min(axis=1), values.max(axis=1), color=line.get_color(), alpha=0.15)
    axes.set(xlabel="probability that a frame is shuffled", ylabel="log density at the truth [nats]")
    axes.legend()
    figure.savefig(path, dpi=150)
    pyplot.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="*", default=[1, 2, 3])
    parser.add_argument("--draws", type=int, default=1000)
    parser.add_argument("--cases", type=int, default=100, help="fresh measurements a posterior is scored on")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    began = time.monotonic()
    installed = REGISTRY.names("estimator")
    sets = [m for m in RKHS if m.name in installed]
    methods = [*sets, *BY_PLACE, SORTED]
    jobs = [(m, p, s) for s in arguments.seeds for p in SHUFFLED for m in methods]
    jobs += [(m, None, s) for s in arguments.seeds for m in SIZES]
    with ProcessPoolExecutor(arguments.workers, mp_context=get_context("spawn")) as pool:
        one = partial(score, draws=arguments.draws, cases=arguments.cases)
        running = {job: pool.submit(one, *job[:2], seed=job[2]) for job in jobs}
        known = {(p, s): pool.submit(exact, p, arguments.cases, s) for s in arguments.seeds for p in (*SHUFFLED, None)}
        results = {job: future.result() for job, future in running.items()}
        exactly = {key: future.result() for key, future in known.items()}

    def scores(method: Method, probability: float | None) -> list[float]:
        return [results[method, probability, s][0] for s in arguments.seeds]

    found = {m.label: np.array([scores(m, p) for p in SHUFFLED]) for m in methods}
    best = np.array([[exactly[p, s] for s in arguments.seeds] for p in SHUFFLED])
    rows = [
        Row(f"keypoints, shuffled {p:g}: exact posterior", float(b.mean()), "nats")
        for p, b in zip(SHUFFLED, best, strict=True)
    ]
    for m in methods:
        rows += [
            Row(f"keypoints, shuffled {p:g}: {m.label}", float(v.mean()), f"nats (+- {v.std(ddof=1):.2f} over seeds)")
            for p, v in zip(SHUFFLED, found[m.label], strict=True)
        ]
        change = float(found[m.label][-1].mean() - found[m.label][0].mean())
        claim = ("-0.1 to 0.1", abs(change) <= 0.1) if m in sets else ("< -0.1", change < -0.1)
        goal = ("", None) if m is SORTED else claim
        rows.append(Row(f"keypoints, from 0 to 1: {m.label}", change, "nats", *goal))
        slowest = max(results[m, p, s][1] for p in SHUFFLED for s in arguments.seeds)
        rows.append(Row(f"fit: {m.label}", slowest, "CPU s"))
    sized = float(np.mean([exactly[None, s] for s in arguments.seeds]))
    rows.append(Row("sets of 1 to 64: exact posterior", sized, "nats"))
    short = [sized - float(np.mean(scores(m, None))) for m in SIZES]
    for m, gap, goal in zip(SIZES, short, (("< the mean alone", short[0] < short[1]), ("", None)), strict=True):
        rows.append(Row(f"sets of 1 to 64: {m.label}, short of it", gap, "nats", *goal))
    report("sets", rows, arguments.seeds, time.monotonic() - began)
    plot(found, best, RESULTS / "sets.png")
    print(f"wrote {RESULTS / 'sets.png'}")


if __name__ == "__main__":
    main()
