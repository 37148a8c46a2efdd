"""Are hidden effects named? Ropes and cloth, in the air and on a table, with a known truth.

Every twenty cases hide nothing (6), an effect of the library at a weak or a strong setting (6), one that no library
has (4), two at once, a known one under another law, one that a look-alike explains as well, and one in data too poor to
show it. Reality is played by the model's own engine, by the same on a finer mesh, or by the other engine; noise is
white or correlated in time, markers may be lost. Strengths are set by the misfit that is left after the model without
the effect was fitted, in units of what is left where nothing is hidden: noise, and the difference of engine or mesh.
Held out is a motion of a type that was never fitted. See ``effects_bench/cases.py``. ::

    make bench-effects                                     # as many development cases as 60 minutes allow
    make bench-effects EFFECTS="--part test --cases 400"   # on seeds that nothing was improved on

Cases come in an order of which any first part is a fair share. A run that is stopped goes on where it was: finished
cases are kept in ``OUTPUT.cells.partial``, unless muslin or what makes the cases has changed.
"""

import argparse
import hashlib
import itertools
import json
import multiprocessing as mp
import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from pathlib import Path
from typing import Any

os.environ.update(OMP_NUM_THREADS="1", MKL_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")  # before anything loads them

from effects_bench.baselines import BASELINES
from effects_bench.cases import BLOCK, FIRST_SEEDS, Case, plan
from effects_bench.running import Plan, run_case
from effects_bench.settings import SETTINGS
from effects_bench.table import as_json, figures, markdown
from table import RESULTS, commit, machine, versions

ROOT = Path(__file__).resolve().parents[2]
#: Whose sources a case depends on.
ROOMS = ("core", "backends", "inference", "plugins")
#: What only reads finished cases.
READERS = ("scoring.py", "table.py")


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", choices=list(FIRST_SEEDS), default="development", help="which seeds")
    parser.add_argument("--cases", type=int, default=100, help="how many (default: 100)")
    parser.add_argument("--minutes", type=float, default=60.0, help="start no case after (default: 60)")
    parser.add_argument("--settings", nargs="*", choices=list(SETTINGS), default=list(SETTINGS), help="these alone")
    parser.add_argument("--kinds", nargs="*", choices=list(BLOCK), default=list(BLOCK), help="of truth, these alone")
    parser.add_argument("--baselines", nargs="*", choices=list(BASELINES), default=list(BASELINES), metavar="NAME")
    parser.add_argument("--draws", type=int, default=500, help="that amortised baselines learn from, a setting")
    parser.add_argument("--at-once", type=int, default=2, help="cases that run beside one another (default: 2)")
    parser.add_argument("--workers", type=int, default=1, help="processes of each study (default: 1)")
    parser.add_argument("--output", type=Path, default=RESULTS / "effects.json")
    return parser.parse_args()


class Kept:
    """Finished cases in a file, one a line; other sources or another plan, other keys."""

    def __init__(self, path: Path, made_of: object) -> None:
        self.path, self._made_of = path, made_of
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        self._found = {key: record for key, record in map(_line, lines) if key}

    def _key(self, case: Case) -> str:
        text = json.dumps([self._made_of, case.as_dict()], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:24]

    def get(self, case: Case) -> dict[str, Any] | None:
        return self._found.get(self._key(case))

    def add(self, case: Case, record: dict[str, Any]) -> None:
        line = json.dumps({"key": self._key(case), "record": record})
        with self.path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")


def _line(text: str) -> tuple[str, dict[str, Any]]:
    """Key and record; no key of a line that a killed run has left half-written."""
    try:
        read = json.loads(text)
        return str(read["key"]), read["record"]
    except (ValueError, KeyError, TypeError):
        return "", {}


def sources() -> str:
    """A hash of all that a finished case depends on."""
    digest = hashlib.sha256()
    bench = [p for p in (Path(__file__).parent / "effects_bench").rglob("*.py") if p.name not in READERS]
    for source in sorted([*bench, *(p for room in ROOMS for p in (ROOT / room).rglob("*.py"))]):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def chosen(part: str, count: int, settings: list[str], kinds: list[str]) -> list[Case]:
    """The first cases of a part that are of these settings and kinds."""
    cases = (c for c in plan(part) if c.setting in settings and c.kind in kinds)
    return list(itertools.islice(cases, count))


def main() -> None:
    a = parsed()
    how = Plan(a.workers, tuple(a.baselines), a.draws)
    a.output.parent.mkdir(parents=True, exist_ok=True)
    kept = Kept(a.output.with_suffix(".cells.partial"), [sources(), how.baselines, how.draws])
    cache = a.output.with_suffix(".draws.partial")
    began, found = time.monotonic(), {}
    cases = chosen(a.part, a.cases, a.settings, a.kinds)
    for number, record in finished(cases, kept, how, cache, a.at_once, began + 60 * a.minutes):
        found[number] = record
        print(f"{number + 1:4d} {told(record)}", flush=True)
    records = [found[number] for number in sorted(found)]
    rows = figures(records, how.baselines)
    table = markdown(rows, how.baselines)
    left_out = sum("left_out" in r for r in records)
    about = f"{len(records)} of {len(cases)} {a.part} cases, of which {left_out} could not be generated; {machine()}\n"
    content = {
        "machine": machine(),
        "versions": versions(),
        "commit": commit(),
        "part": a.part,
        "seeds": [r["case"]["seed"] for r in records],
        "seconds": round(time.monotonic() - began, 1),
        "figures": as_json(rows),
        "cases": [short(r) for r in records],
    }
    a.output.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    a.output.with_suffix(".md").write_text(f"{about}\n{table}", encoding="utf-8")
    print(f"\n{about}\n{table}\nwrote {a.output} and {a.output.with_suffix('.md')}")


def finished(
    cases: Sequence[Case], kept: Kept, how: Plan, cache: Path, at_once: int, deadline: float
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Index and record of the cases that are kept, then of those that can start before ``deadline``, as they end."""
    known = {number: record for number, case in enumerate(cases) if (record := kept.get(case)) is not None}
    yield from known.items()
    left = iter([number for number in range(len(cases)) if number not in known])
    running: dict[Future[dict[str, Any]], int] = {}
    with ProcessPoolExecutor(at_once, mp_context=mp.get_context("spawn")) as pool:
        while True:
            while len(running) < at_once and time.monotonic() < deadline and (number := next(left, None)) is not None:
                running[pool.submit(run_case, cases[number], how, cache)] = number
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                number = running.pop(future)
                kept.add(cases[number], future.result())
                yield number, future.result()


def short(record: dict[str, Any]) -> dict[str, Any]:
    """What the results keep of one case; its seed makes all of it again."""
    case, truth, d = record["case"], record.get("truth", {}), record.get("diagnosis", {})
    kept = {k: case[k] for k in ("seed", "kind", "setting", "role", "source", "noise", "correlated", "dropouts")}
    kept |= {f"true_{k}": truth[k] for k in ("effects", "rivals", "coefficients", "misfit", "left") if k in truth}
    kept |= {k: d[k] for k in ("verdict", "effects", "error") if k in d}
    kept |= {"first": d["candidates"][0]["name"] if d else None}
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
    return (
        f"{where} {misfit:<34} {d['verdict']}: {', '.join(d['effects']) or '-':<24} "
        f"[{d['candidates'][0]['name']}] held out {error['before']:.2f} -> {error['after']:.2f} mm, "
        f"noise {1e3 * case['noise']:.0f}; {record['simulations']} simulations, {record['seconds']:.0f} s; {rivals}"
    )


if __name__ == "__main__":
    main()
