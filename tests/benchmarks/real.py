"""Real recordings: how far the model is off on takes that it was not fitted to, and which effect is named.

Balls and beam are in the repository; the others are read from the folder in the environment variable MUSLIN_DATA, and
skipped where it has none::

    make bench-real        or        python tests/benchmarks/real.py --only 'cable 2'
"""

import argparse
import json
import tempfile
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from real_cases import CASES, Case
from table import RESULTS, machine, versions

from muslin.core.errors import RolloutFailed
from muslin.core.registry import REGISTRY
from muslin.core.study import Problem, Study, build_problem

COLUMNS = ("baseline", "unfitted", "fitted", "after", "noise")
TITLES = ("set", "fitted on", "held out", *COLUMNS, "verdict", "rollouts", "seconds")


def absolute(problem: Problem, values: Mapping[str, float], effects: list[str]) -> dict[str, float]:
    """Errors [m] on the held-out takes of ``problem``: of a point, the median; of a coordinate, the mean absolute one.

    ``median_take`` is the median over takes of the latter, ``failed`` how many takes could not be simulated; NaN where
    none could.
    """
    problem = replace(problem, effects={n: REGISTRY.get("effect", n) for n in effects})
    off, failed = [], 0
    for name in problem.hold_out:
        try:
            simulated = problem.simulate(values, name).series.points
        except RolloutFailed:
            failed += 1
            continue
        difference = simulated - problem.recordings[name].series.points
        off.append(difference[np.isfinite(difference).all(axis=2)])
    if not off:
        return {"takes": 0, "failed": failed} | dict.fromkeys(
            ("median_point", "mean_coordinate", "median_take"), np.nan
        )
    every = np.concatenate(off)
    return {
        "takes": len(off),
        "failed": failed,
        "median_point": float(np.median(np.linalg.norm(every, axis=1))),
        "mean_coordinate": float(np.mean(np.abs(every))),
        "median_take": float(np.median([np.mean(np.abs(o)) for o in off])),
    }


def never_used(study: Study) -> Problem | None:
    """Of the takes that are in the measurement and neither fitted nor held out, as held-out ones; None without any."""
    known = {*study.problem.fit_on, *study.problem.hold_out}
    left = [n for n in study.measurement.names if n not in known]
    if not left:
        return None
    config = study.config.model_copy(deep=True)
    config.study.hold_out = left
    return build_problem(config, study.measurement, study.path.parent)


def row_of(case: Case, study: Study) -> dict[str, Any]:
    """One line of the table, lengths in metres: fit, compare, diagnose."""
    began = time.monotonic()
    fit = study.fit()
    held = [r for r in study.compare().rows if r.role == "held-out"]
    found = study.diagnose().result
    seconds = time.monotonic() - began
    row: dict[str, Any] = {
        "set": case.name,
        "fitted on": list(study.problem.fit_on),
        "held out": list(study.problem.hold_out),
        "baseline": rms([r.baseline for r in held]),
        "unfitted": rms([r.default for r in held]),
        "fitted": rms([r.rmse for r in held]),
        "after": found["error"]["after"] if found["effects"] else None,
        "noise": fit.noise.sd,
        "noise from": fit.noise.source,
        "verdict": f"{found['verdict']}: {', '.join(found['effects']) or '-'}",
        "rollouts": int(fit.simulations) + int(found["simulations"]),
        "seconds": round(seconds, 1),
        "estimate": fit.values(),
        "told": found["told"],
        "candidates": [
            {k: c[k] for k in ("name", "coefficients", "explained", "z", "objection", "held_out_after")}
            for c in found["candidates"][:5]
        ],
    }
    if case.open_loop:
        row |= open_loop(study, fit.values(), found["effects"])
    return row | {"machine": machine(), "versions": versions()}


def open_loop(study: Study, fitted: Mapping[str, float], effects: list[str]) -> dict[str, Any]:
    """:func:`absolute` of the middle of the prior, of the fit, and with what was named; on takes never used, too."""
    space = study.problem.space
    states = {"unfitted": (space.as_dict(space.from_unit(np.full(len(space), 0.5))), []), "fitted": (fitted, [])}
    models = study.results()["diagnose"].attrs["models"]
    for model in models:
        if effects and model["effects"] in (effects, effects[:1]):
            states["after"] = model["values"], model["effects"]
            break
    problems = {"open loop": study.problem, "never used": never_used(study)}
    return {
        f"{state} {which}": absolute(problem, values, added)
        for which, problem in problems.items()
        if problem is not None
        for state, (values, added) in states.items()
    }


def rms(errors: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def joined(
    old: Mapping[str, Any], rows: list[dict[str, Any]], skipped: Mapping[str, str]
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Rows and skipped sets of this run beside those of ``old``, the content of an earlier ``real.json``.

    Every row keeps the machine and the versions that it was made with. A set that was skipped now keeps its row.
    """
    made = {r["set"]: r for r in rows}
    for row in old.get("rows", []):
        labels = {key: row.get(key, old.get(key)) for key in ("machine", "versions")}
        made.setdefault(row["set"], row | labels)
    left = {name: why for name, why in {**old.get("skipped", {}), **skipped}.items() if name not in made}
    place = {c.name: k for k, c in enumerate(CASES)}
    return sorted(made.values(), key=lambda r: place.get(r["set"], len(place))), left


def markdown(rows: list[dict[str, Any]], skipped: Mapping[str, str]) -> str:
    lines = ["| " + " | ".join(TITLES) + " |", "|" + "---|" * len(TITLES)]
    for r in rows:
        lengths = ["–" if r[c] is None else f"{1e3 * r[c]:.4g}" for c in COLUMNS]
        cells = [r["set"], ", ".join(r["fitted on"]), ", ".join(r["held out"]), *lengths, r["verdict"]]
        lines.append("| " + " | ".join([*cells, str(r["rollouts"]), f"{r['seconds']:.0f}"]) + " |")
    lines += ["", "Errors on held-out takes in mm, root mean square a coordinate.", ""]
    for r in rows:
        for state in (f"{s} {w}" for w in ("open loop", "never used") for s in ("unfitted", "fitted", "after")):
            if (e := r.get(state)) is not None:
                lines.append(
                    f"- {r['set']}, {state.replace('never used', 'open loop on takes never used')}: median point error "
                    f"{1e3 * e['median_point']:.1f} mm, mean absolute coordinate error "
                    f"{1e3 * e['mean_coordinate']:.1f} mm{_of_takes(e)}"
                )
    lines += [f"- skipped: {name}: {why}" for name, why in skipped.items()]
    return "\n".join(lines) + "\n"


def _of_takes(e: Mapping[str, float]) -> str:
    if "takes" not in e:
        return ""
    failed = f", {e['failed']} more could not be simulated" if e["failed"] else ""
    return f" ({1e3 * e['median_take']:.1f} mm in the median over {e['takes']} takes{failed})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=None)
    parser.add_argument("--only", nargs="*", help=f"of {', '.join(c.name for c in CASES)}; the others keep their rows")
    told = parser.parse_args()
    rows: list[dict[str, Any]] = []
    skipped: dict[str, str] = {}
    for case in CASES:
        if told.only is not None and case.name not in told.only:
            continue
        if not case.needs.exists():
            skipped[case.name] = f"there is no {case.needs.name} where MUSLIN_DATA points"
            print(f"skipped {case.name}: {skipped[case.name]}", flush=True)
            continue
        with tempfile.TemporaryDirectory() as folder:
            row = row_of(case, case.make(Path(folder), told.workers))
        rows.append(row)
        print(f"{case.name}: {row['verdict']}, {row['seconds']:.0f} s", flush=True)
    path = RESULTS / "real.json"
    old = json.loads(path.read_text(encoding="utf-8")) if told.only is not None and path.exists() else {}
    old["skipped"] = old.get("skipped") or {}
    rows, skipped = joined(old, rows, skipped)
    text = markdown(rows, skipped)
    print("\n" + text)
    content = json.dumps({"rows": rows, "skipped": skipped}, indent=1, ensure_ascii=False)
    path.write_text(content + "\n", encoding="utf-8")
    path.with_suffix(".md").write_text(text, encoding="utf-8")
    print(f"wrote {path} and real.md")


if __name__ == "__main__":
    main()
