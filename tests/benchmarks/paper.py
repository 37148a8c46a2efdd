"""The protocol of the paper (Antonova et al., *A Bayesian Treatment of Real-to-Sim*), with the truth known.

Each scenario really happens once with hidden parameters: in the model's own engine (``same``), or in the other one with
a finer mesh (``other``). A camera of 320 x 320 pixels gives K keypoints a frame, noisy, in no order, without those
that something hides; every draw is seen through the same detector. Each method infers bending and stretch stiffness,
friction and size in rounds of draws, the bulk methods from as many draws of the prior at once. Draws of the first round
are the same for all. The grippers move the same way in every draw, so their poses are not among what is seen.

The measure is the paper's, on masks from muslin's own renderer in place of colour masks of camera pictures: the
bidirectional Chamfer distance between the object's pixels, averaged over time, between what really happened and
trajectories with parameters drawn from the posterior; mean and one standard deviation over 30 of them. Beside it:
``prior`` (draws from the prior) and ``truth`` (the model with the hidden parameters; above zero where the reality is of
another engine), and the posterior's log density at the hidden parameters, of which the prior has 0. ::

    make bench-paper                                     # the whole: 15 rounds of 100, for a weekend
    python tests/benchmarks/paper.py --iterations 3 --per-iteration 50 --keypoints 4 --reality other --evaluations 8

A run that is stopped goes on where it was: finished cells are kept in ``NAME.cells.partial`` beside the output.
"""

import argparse
import hashlib
import json
import os
import time
from dataclasses import asdict
from itertools import product
from pathlib import Path

os.environ.update(OMP_NUM_THREADS="1", MKL_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")  # before anything loads them

from paper_loop import BULK, Cell, Plan, Score, Stage, bounds, run
from paper_plot import draw, told
from paper_scene import SETTINGS
from table import RESULTS, machine, versions

from muslin.core.errors import MuslinError
from muslin.core.registry import REGISTRY

ROOT = Path(__file__).resolve().parents[2]
#: Whose sources a result depends on.
ROOMS = ("core", "backends", "perception", "inference", "tests/benchmarks")
METHODS = (
    "bayessim-mdnn",
    "bayessim-mdrff",
    "bayessim-rkhs",
    "bayeszoom",
    "bayeszoom-rkhs",
    *BULK,
    "npe-rkhs",
)


def parsed() -> argparse.Namespace:
    known = [m for m in METHODS if m in REGISTRY.names("estimator")]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--iterations", type=int, default=15, help="rounds (default: 15)")
    parser.add_argument("--per-iteration", type=int, default=100, help="draws of a round (default: 100)")
    parser.add_argument("--evaluations", type=int, default=30, help="trajectories a distance (default: 30)")
    parser.add_argument("--seeds", nargs="*", type=int, default=[1], help="of hidden parameters, noise and draws")
    parser.add_argument("--scenarios", nargs="*", choices=list(SETTINGS), default=list(SETTINGS))
    parser.add_argument("--keypoints", nargs="*", type=int, choices=range(2, 9), default=[4, 8], metavar="K")
    parser.add_argument("--methods", nargs="*", choices=known, default=known, metavar="NAME", help=", ".join(known))
    parser.add_argument("--reality", nargs="*", choices=["same", "other"], default=["same", "other"])
    parser.add_argument("--space", choices=["pixels", "metres"], default="pixels", help="of the keypoints")
    parser.add_argument("--proposals", choices=["posterior", "truncated", "gaussian"], default="posterior")
    parser.add_argument("--preset", choices=["default", "paper"], default="default", help="of the estimators")
    parser.add_argument("--workers", type=int, default=None, help="processes (default: one a core)")
    parser.add_argument("--output", type=Path, default=RESULTS / "paper.json")
    return parser.parse_args()


class Kept:
    """Finished cells in a file, one a line; a change of the plan, or of any source of muslin, makes other keys."""

    def __init__(self, path: Path, plan: Plan) -> None:
        digest = hashlib.sha256()
        for source in sorted(p for room in ROOMS for p in (ROOT / room).rglob("*.py")):
            digest.update(source.read_bytes())
        self.path, self._made_of = path, [asdict(plan), digest.hexdigest()[:16]]
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        self._found = {line["key"]: line["scores"] for line in map(json.loads, lines)}

    def _key(self, cell: Cell) -> str:
        return json.dumps([*self._made_of, cell])

    def get(self, cell: Cell) -> list[Score] | None:
        found = self._found.get(self._key(cell))
        return None if found is None else [Score(**s) for s in found]

    def add(self, cell: Cell, scores: list[Score]) -> None:
        line = json.dumps({"key": self._key(cell), "scores": [asdict(s) for s in scores]})
        with self.path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")


def main() -> None:
    a = parsed()
    plan = Plan(a.iterations, a.per_iteration, a.evaluations, a.proposals, a.preset, a.space)
    a.output.parent.mkdir(parents=True, exist_ok=True)
    kept = Kept(a.output.with_suffix(".cells.partial"), plan)
    for missing in sorted(set(METHODS) - set(REGISTRY.names("estimator"))):
        print(f"{missing} is not installed and left out")
    began, found, renderer = time.monotonic(), {}, ""
    for name in a.scenarios:
        stage = Stage(SETTINGS[name], plan, a.workers)
        renderer = stage.renderer
        try:
            for reality, seed, count in product(a.reality, a.seeds, a.keypoints):
                for method in ("bounds", *a.methods):
                    cell = Cell(name, reality, count if method != "bounds" else 0, seed, method)
                    if cell not in found and (scores := _scores(stage, cell, kept, began)):
                        found[cell] = scores
        finally:
            stage.close()
    report = {
        "machine": machine(),
        "versions": versions(),
        "plan": asdict(plan),
        "renderer": renderer,
        "seeds": a.seeds,
        "seconds": round(time.monotonic() - began, 1),
        "parameters": list(SETTINGS[a.scenarios[0]].space.names),
        "cells": [{**cell._asdict(), "scores": [asdict(s) for s in scores]} for cell, scores in found.items()],
    }
    a.output.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    print(told(found))
    print("wrote", a.output, *draw(found, plan, a.output.with_suffix("")))
    kept.path.unlink(missing_ok=True)


def _scores(stage: Stage, cell: Cell, kept: Kept, began: float) -> list[Score]:
    """Of one cell, from an earlier run if it was finished there; none where the method fails."""
    known = kept.get(cell)
    if known is not None:
        return known
    where = f"{cell.scenario}, {cell.reality}, K {cell.keypoints}, seed {cell.seed}, {cell.method}"

    def progress(text: str) -> None:
        print(f"{time.monotonic() - began:6.0f} s  {where}: {text}", flush=True)

    try:
        if cell.method == "bounds":
            scores = list(bounds(stage, cell.reality, cell.seed).values())
        else:
            scores = list(run(stage, cell, progress))
    except MuslinError as error:
        progress(f"failed: {error}")
        return []
    kept.add(cell, scores)
    last = scores[-1]
    progress(f"{last.distance:.2f} +- {last.deviation:.2f} px, log density at the truth {last.log_prob:.2f}")
    return scores


if __name__ == "__main__":
    main()
