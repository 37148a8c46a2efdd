"""muslin's estimators and sbi's NPE-C held against posteriors that are known, on the same simulations in one run.

Tasks, observations and posterior draws are sbibm's (Lueckmann et al., *Benchmarking Simulation-Based Inference*, 2021),
and so is the measure: the accuracy of a classifier that tells posterior samples from the known ones (C2ST, an MLP on
z-scored samples, five folds); 0.5 is perfect, 1 is told apart every time. sbi trains its three density nets with its
defaults, one round, amortised; muslin's estimators come with theirs. Each cell of the table is a process on one
thread, so seconds are processor seconds and runs may share a machine::

    make bench-inference                                         # hours: everything, ten observations
    python tests/benchmarks/inference.py --tasks two_moons --simulations 1000 --observations 1 2 3 \
        --estimators npe-rkhs auto --rivals sbi-mdn              # minutes; written to results only with --output

A run that is stopped goes on where it was: finished cells are kept beside the output, in ``NAME.cells.partial``, until
the options, the libraries or the code of the estimators change. A cell over its time, and an observation for which
sbi's rejection within the prior takes too long, are shown as missing and told of below the table.

Fewer samples flatter everyone, as the classifier learns less: ``--tasks two_moons --simulations 1000 --observations 1 2
--rivals sbi-mdn --estimators`` prints 0.597 with ``--samples 1000`` and 0.698 with 2000, of the same net. Figures from
different ``--samples`` do not compare, nor with published ones, which have 10 000.
"""

import argparse
import json
import os
import signal
import sys
import time
from dataclasses import asdict
from importlib.metadata import version
from itertools import product
from pathlib import Path

os.environ.update(OMP_NUM_THREADS="1", MKL_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")  # before anything loads them

from inference_cell import RIVALS, Cell, Outcome
from inference_pool import Kept, run_all
from inference_table import Figures, goals, show
from inference_tasks import AS_A_SET, ROWS
from table import RESULTS, machine, versions

from muslin.core.registry import REGISTRY


def parsed() -> argparse.Namespace:
    registered = REGISTRY.names("estimator")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", nargs="*", choices=ROWS, default=list(ROWS), metavar="TASK", help=", ".join(ROWS))
    parser.add_argument("--simulations", nargs="*", type=int, default=[1000, 10_000])
    parser.add_argument("--observations", nargs="*", type=int, default=list(range(1, 11)), help="of 1 to 10")
    parser.add_argument("--seeds", nargs="*", type=int, default=[1])
    parser.add_argument("--estimators", nargs="*", choices=registered, default=registered, metavar="NAME")
    parser.add_argument("--rivals", nargs="*", choices=list(RIVALS), default=list(RIVALS), metavar="NAME")
    parser.add_argument("--samples", type=int, default=2000, help="of each posterior, for the C2ST (default: 2000)")
    parser.add_argument("--workers", type=int, default=2, help="processes at a time (default: 2)")
    parser.add_argument("--limit", type=float, default=3600.0, help="wall time of a cell [s] (default: 3600)")
    parser.add_argument("--sampling-limit", type=float, default=60.0, help="of one observation's samples [s]")
    parser.add_argument("--output", type=Path, help="JSON file (default: results/inference.json for a full run)")
    return parser.parse_args()


def cells_of(a: argparse.Namespace) -> list[Cell]:
    """Rivals first, so that there is something to compare with early; sets are for those that read sets."""
    observed = tuple(sorted(set(a.observations)))
    return [
        Cell(row, simulations, seed, method, observed, a.samples, a.limit, a.sampling_limit)
        for simulations, row, seed, method in product(a.simulations, a.tasks, a.seeds, [*a.rivals, *a.estimators])
        if not (method in RIVALS and row.endswith(AS_A_SET))
    ]


def told(cell: Cell, outcome: Outcome, left: int) -> None:
    scores = [s for s in outcome.c2st if s is not None]
    found = f"{sum(scores) / len(scores):.3f} after {outcome.train_cpu:.1f} s" if scores else "nothing"
    note = f" ({outcome.note})" if outcome.note else ""
    print(f"{cell.row}, {cell.simulations}, seed {cell.seed}, {cell.method}: {found}{note}; {left} to come", flush=True)


def main() -> None:
    a = parsed()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # an orderly end takes the cells that are running along
    whole = (a.tasks, a.estimators, a.rivals) == (list(ROWS), REGISTRY.names("estimator"), list(RIVALS))
    output: Path | None = a.output or (RESULTS / "inference.json" if whole else None)
    kept_at = (output or RESULTS / "inference.json").with_suffix(".cells.partial")
    began = time.monotonic()
    cells = cells_of(a)
    outcomes = run_all(cells, Kept(kept_at), a.workers, told)
    outcomes = {cell: outcomes[cell] for cell in cells}
    figures = Figures(outcomes)
    print(f"\ninference: {machine()}; C2ST on {a.samples} samples, observations {a.observations}, seeds {a.seeds}")
    show(figures)
    rows = goals(figures)
    for r in rows:
        print(f"  {r.figure:<70} {r.value} {r.unit} goal {r.goal}: {'met' if r.met else 'MISSED'}")
    if output is None:
        return
    content = {
        "machine": machine(),
        "versions": versions() | {p: version(p) for p in ("sbi", "sbibm", "zuko", "scikit-learn")},
        "seeds": a.seeds,
        "observations": a.observations,
        "samples": a.samples,
        "seconds": round(time.monotonic() - began, 1),
        "table": [
            {
                "task": line[0], "simulations": line[1], "method": method,
                "c2st": figures.c2st(line, method), "between_seeds": figures.deviation(line, method),
                "train_cpu_s": figures.seconds(line, method), "train_wall_s": figures.wall(line, method),
            }
            for line, method in product(figures.lines, figures.methods)
        ],
        "cells": [asdict(cell) | asdict(outcome) for cell, outcome in outcomes.items()],
        "notes": figures.notes(),
        "rows": [asdict(r) for r in rows],
    }  # fmt: skip
    output.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    print(f"wrote {output}")


if __name__ == "__main__":
    main()
