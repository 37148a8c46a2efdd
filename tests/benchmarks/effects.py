"""Are hidden effects named? Ropes and cloth, in the air and on a table, with a known truth.

Every twenty cases hide nothing (6), an effect of the library at a weak or a strong setting (6), one that no library
has (4), two at once, a known one under another law, one that a look-alike explains as well, and one in data too poor to
show it. Reality is played by the model's own engine, by the same on a finer mesh, or by the other engine; noise is
white or correlated in time, markers may be lost. Strengths are set by the misfit that is left after the model without
the effect was fitted, in units of what is left where nothing is hidden: noise, and the difference of engine or mesh.
Held out is a motion of a type that was never fitted. See ``effects_bench/cases.py``. ::

    make bench-effects                                     # as many development cases as 60 minutes allow
    make bench-effects EFFECTS="--part test --cases 400"   # on seeds that nothing was improved on
    make bench-effects EFFECTS="--first-seed 1020010 --seeds 1020014 --output again.json"   # a case by itself

Cases come in an order of which any first part is a fair share. A run that is stopped goes on where it was: finished
cases and the answers of baselines are kept in ``OUTPUT.cells.partial``, unless muslin or what makes them has changed.
So a first run may leave the baselines out (``--baselines`` with no name), and a later one ask them.
"""

import argparse
import itertools
import json
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

os.environ.update(OMP_NUM_THREADS="1", MKL_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")  # before anything loads them

from effects_bench.baselines import BASELINES
from effects_bench.cases import BLOCK, FIRST_SEEDS, Case, plan
from effects_bench.run import Run
from effects_bench.settings import SETTINGS
from effects_bench.table import as_json, figures, markdown
from table import RESULTS, commit, machine, versions


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", choices=list(FIRST_SEEDS), default="development", help="which seeds")
    parser.add_argument("--first-seed", type=int, help="of an earlier batch, to make it again (default: the part's)")
    parser.add_argument("--cases", type=int, default=100, help="how many (default: 100)")
    parser.add_argument("--seeds", type=int, nargs="+", default=[], help="cases of that batch, these alone")
    parser.add_argument("--minutes", type=float, default=60.0, help="start no case after (default: 60)")
    parser.add_argument("--settings", nargs="*", choices=list(SETTINGS), default=list(SETTINGS), help="these alone")
    parser.add_argument("--kinds", nargs="*", choices=list(BLOCK), default=list(BLOCK), help="of truth, these alone")
    parser.add_argument("--baselines", nargs="*", choices=list(BASELINES), default=list(BASELINES), metavar="NAME")
    parser.add_argument("--draws", type=int, default=500, help="that amortised baselines learn from, a setting")
    parser.add_argument("--at-once", type=int, default=2, help="cases that run beside one another (default: 2)")
    parser.add_argument("--workers", type=int, default=1, help="processes of each study (default: 1)")
    batch = RESULTS / "effects.json"
    parser.add_argument("--output", type=Path, default=batch)
    told = parser.parse_args()
    told.first_seed = FIRST_SEEDS[told.part] if told.first_seed is None else told.first_seed
    if told.seeds and told.output == batch:
        parser.error(f"--seeds needs an --output of its own: {batch} is for whole batches")
    if told.seeds and min(told.seeds) < told.first_seed:
        parser.error(f"the batch begins with --first-seed {told.first_seed}, after --seeds {min(told.seeds)}")
    return told


def chosen(first_seed: int, count: int, settings: list[str], kinds: list[str], seeds: Sequence[int] = ()) -> list[Case]:
    """The first cases from a seed on that are of these settings and kinds; if any ``seeds`` are given, of these."""
    whole = itertools.takewhile(lambda c: not seeds or c.seed <= max(seeds), plan(first_seed))
    cases = (c for c in whole if c.setting in settings and c.kind in kinds and (not seeds or c.seed in seeds))
    return list(itertools.islice(cases, count))


def main() -> None:
    a = parsed()
    a.output.parent.mkdir(parents=True, exist_ok=True)
    found, deadline = {}, time.monotonic() + 60 * a.minutes
    cases = chosen(a.first_seed, a.cases, a.settings, a.kinds, a.seeds)
    kept, cache = (a.output.with_suffix(f".{what}.partial") for what in ("cells", "draws"))
    run = Run(kept, cache, a.workers, tuple(a.baselines), a.draws)
    for number, record in run.finished(cases, a.at_once, deadline):
        found[number] = record
        print(f"{number + 1:4d} {told(record)}", flush=True)
    records = [found[number] for number in sorted(found)]
    rows = figures(records, a.baselines)
    table = markdown(rows, a.baselines)
    left_out = sum("left_out" in r for r in records)
    about = f"{len(records)} of {len(cases)} {a.part} cases, of which {left_out} could not be generated; {machine()}\n"
    content = {
        "machine": machine(),
        "versions": versions(),
        "commit": commit(),
        "part": a.part,
        "seeds": [r["case"]["seed"] for r in records],
        "figures": as_json(rows),
        "cases": [short(r) for r in records],
    }
    a.output.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    a.output.with_suffix(".md").write_text(f"{about}\n{table}", encoding="utf-8")
    print(f"\n{about}\n{table}\nwrote {a.output} and {a.output.with_suffix('.md')}")


def short(record: dict[str, Any]) -> dict[str, Any]:
    """What the results keep of one case; its seed makes all of it again."""
    case, truth, d = record["case"], record.get("truth", {}), record.get("diagnosis", {})
    kept = {k: case[k] for k in ("seed", "kind", "setting", "role", "source", "noise", "correlated", "dropouts")}
    kept |= {f"true_{k}": truth[k] for k in ("effects", "rivals", "coefficients", "misfit", "left") if k in truth}
    kept |= {k: d[k] for k in ("verdict", "effects", "error") if k in d}
    kept |= {"first": d["candidates"][0]["name"] if d else None}
    kept |= {"explained": d["evidence"]["explained"]} if d else {}
    kept |= {k: record[k] for k in ("simulations", "seconds", "processor_seconds", "failed", "left_out") if k in record}
    return kept | {"baselines": {n: b["name"] or b["held_out"] for n, b in record.get("baselines", {}).items()}}


def told(record: dict[str, Any]) -> str:
    """One line for one case."""
    case = record["case"]
    where = f"{case['seed']} {case['setting']:<11} {case['source']:<6} {case['kind']:<8}"
    if "left_out" in record:
        return f"{where} left out: {record['left_out']}"
    misfit = ", ".join(f"{n} ({m:.1f} sd)" for n, m in record["truth"]["misfit"].items()) or "-"
    if record["failed"]:
        return f"{where} {misfit:<34} FAILED: {record['failed']}"
    d = record["diagnosis"]
    error = {k: 1e3 * float(d["error"][k]) for k in ("before", "after")}
    rivals = ", ".join(f"{n}: {b['name'] or '-'}" for n, b in record["baselines"].items())
    rivals = rivals and f"; {rivals}"
    return (
        f"{where} {misfit:<34} {d['verdict']}: {', '.join(d['effects']) or '-':<24} "
        f"[{d['candidates'][0]['name']}] held out {error['before']:.2f} -> {error['after']:.2f} mm, "
        f"noise {1e3 * case['noise']:.0f}; {record['simulations']} simulations, {record['seconds']:.0f} s{rivals}"
    )


if __name__ == "__main__":
    main()
