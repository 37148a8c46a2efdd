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
from pathlib import Path
from typing import Any

import numpy as np
from real_cases import CASES, ROOT, Case
from real_measures import fitted_takes, measures, open_loop
from table import RESULTS, commit, machine, versions

from muslin.cli.report import overview_figure
from muslin.core.study import Study
from muslin.inference.sequential.result import load_fit

PICTURES = ROOT / "docs/real"
COLUMNS = ("baseline", "unfitted", "fitted", "after", "noise")
TITLES = ("set", "fitted on", "held out", *COLUMNS, "verdict", "rollouts", "seconds")


def row_of(case: Case, study: Study) -> dict[str, Any]:
    """One line of the table, lengths in metres: fit, compare, diagnose; then with what was named, fitted anew.

    Of several effects that are tied the first is taken.
    """
    began = time.monotonic()
    fit = study.fit()
    held = [r for r in study.compare().rows if r.role == "held-out"]
    found = study.diagnose().result
    middle = study.problem.space.as_dict(study.problem.space.from_unit(np.full(len(study.problem.space), 0.5)))
    states = {"unfitted": (study, middle), "fitted": (study, fit.values())}
    row: dict[str, Any] = {
        "set": case.name,
        "fitted on": fitted_takes(study),
        "held out": list(study.problem.hold_out),
        "baseline": rms([r.baseline for r in held]),
        "unfitted": rms([r.default for r in held]),
        "fitted": rms([r.rmse for r in held]),
        "after": None,
        "noise": fit.noise.sd,
        "noise from": fit.noise.source,
        "verdict": f"{found['verdict']}: {', '.join(found['effects']) or '-'}",
        "rollouts": int(fit.simulations) + int(found["simulations"]),
        "posterior": posterior(study),
        **measures(study),
        "told": found["told"],
        "candidates": [
            {k: c[k] for k in ("name", "coefficients", "explained", "z", "objection", "held_out_after")}
            for c in found["candidates"][:5]
        ],
    }
    named = found["effects"][: 1 if found["verdict"] == "tied" else None]
    better = study.add(named) if named else None
    if better is not None:
        after = better.fit()
        row["after"] = rms([r.rmse for r in better.compare().rows if r.role == "held-out"])
        row["rollouts"] += int(after.simulations)
        row["posterior after"] = posterior(better)
        row |= {f"{name} after": value for name, value in measures(better).items()}
        states["after"] = better, after.values()
    row["seconds"] = round(time.monotonic() - began, 1)
    if case.open_loop:
        row |= open_loop(states)
    if case.picture:
        PICTURES.mkdir(exist_ok=True)
        (PICTURES / f"{case.slug}.png").write_bytes(overview_figure(study, better))
    return row | {"machine": machine(), "versions": versions(), "commit": commit()}


def posterior(study: Study) -> dict[str, dict[str, float | str]]:
    """Of every parameter the best fit, and the 5, 50 and 95 % quantiles of the posterior."""
    fit = load_fit(study)
    quantiles = np.quantile(fit.samples, [0.05, 0.5, 0.95], axis=0).T
    return {
        name: {"best": float(best), "low": float(low), "median": float(middle), "high": float(high), "unit": unit}
        for name, unit, best, (low, middle, high) in zip(fit.names, fit.units, fit.estimate, quantiles, strict=True)
    }


def rms(errors: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def joined(
    old: Mapping[str, Any], rows: list[dict[str, Any]], skipped: Mapping[str, str]
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Rows and skipped sets of this run beside those of ``old``, the content of an earlier ``real.json``.

    Every row keeps the machine and the versions that it was made with. A set that was skipped now keeps its row; what
    is no set any more loses it.
    """
    place = {c.name: k for k, c in enumerate(CASES)}
    made = {r["set"]: r for r in rows}
    for row in old.get("rows", []):
        labels = {key: row.get(key, old.get(key)) for key in ("machine", "versions")}
        if row["set"] in place:
            made.setdefault(row["set"], row | labels)
    without = place.keys() - made.keys()
    left = {name: why for name, why in {**old.get("skipped", {}), **skipped}.items() if name in without}
    return sorted(made.values(), key=lambda r: place[r["set"]]), left


def markdown(rows: list[dict[str, Any]], skipped: Mapping[str, str]) -> str:
    lines = ["| " + " | ".join(TITLES) + " |", "|" + "---|" * len(TITLES)]
    for r in rows:
        lengths = ["–" if r[c] is None else f"{1e3 * r[c]:.4g}" for c in COLUMNS]
        cells = [r["set"], ", ".join(r["fitted on"]), ", ".join(r["held out"]), *lengths, r["verdict"]]
        lines.append("| " + " | ".join([*cells, str(r["rollouts"]), f"{r['seconds']:.0f}"]) + " |")
    lines += ["", "Errors on held-out takes in mm, root mean square a coordinate.", ""]
    for r in rows:
        lines += [line for line in (_of_posterior(r), _of_measures(r)) if line]
        for state in (f"{s} {w}" for w in ("open loop", "never used") for s in ("unfitted", "fitted", "after")):
            if (e := r.get(state)) is not None:
                lines.append(
                    f"- {r['set']}, {state.replace('never used', 'open loop on takes never used')}: {_told(e)}"
                )
    lines += [f"- skipped: {name}: {why}" for name, why in skipped.items()]
    return "\n".join(lines) + "\n"


def _of_posterior(row: Mapping[str, Any]) -> str:
    known = row.get("posterior after") or row.get("posterior")
    if not known:
        return ""
    each = (
        f"{name} {p['best']:.3g}{'' if p['unit'] == '1' else ' ' + p['unit']} ({p['low']:.3g} to {p['high']:.3g})"
        for name, p in known.items()
    )
    return f"- {row['set']}: best fit (90 % of the posterior): {', '.join(each)}"


def _of_measures(row: Mapping[str, Any]) -> str:
    if "coverage" not in row:
        return ""
    each = [_measured(row, w) for w in ("", " after") if f"coverage{w}" in row]
    return f"- {row['set']}, held out: {'; with what was named: '.join(each)}"


def _measured(row: Mapping[str, Any], which: str) -> str:
    low, high = (1e3 * x for x in row[f"mean_point_interval{which}"])
    sheet = f"mean_surface{which}"
    return (
        f"mean point error {1e3 * row[f'mean_point{which}']:.1f} mm ({low:.1f} to {high:.1f}), "
        + (f"{1e3 * row[sheet]:.1f} mm to the sheet, " if sheet in row else "")
        + f"{1e3 * row[f'largest{which}']:.1f} mm in the worst frame; {100 * row[f'coverage{which}']:.0f} % of the "
        "coordinates within the posterior's 90 % intervals"
    )


def _told(e: Mapping[str, Any]) -> str:
    text = f"median point error {1e3 * e['median_point']:.1f} mm"
    text += f", mean absolute coordinate error {1e3 * e['mean_coordinate']:.1f} mm"
    if "takes" not in e:
        return text
    failed = f", {e['failed']} more could not be simulated" if e["failed"] else ""
    return f"{text} ({1e3 * e['median_take']:.1f} mm in the median over {e['takes']} takes{failed})"


def written(path: Path, rows: list[dict[str, Any]], skipped: Mapping[str, str]) -> str:
    """Put rows into the results at ``path``, beside those that it has, and return them all as markdown."""
    old = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    rows, skipped = joined(old, rows, skipped)
    text = markdown(rows, skipped)
    content = json.dumps({"rows": rows, "skipped": skipped}, indent=1, ensure_ascii=False)
    path.write_text(content + "\n", encoding="utf-8")
    path.with_suffix(".md").write_text(text, encoding="utf-8")
    return text


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=None)
    known = [c.name for c in CASES]
    parser.add_argument("--only", nargs="+", choices=known, metavar="SET", help=f"of {', '.join(known)}")
    told = parser.parse_args()
    path, text = RESULTS / "real.json", ""
    for case in CASES:
        if told.only is not None and case.name not in told.only:
            continue
        if not case.needs.exists():
            why = f"there is no {case.needs.name} where MUSLIN_DATA points"
            text = written(path, [], {case.name: why})
            print(f"skipped {case.name}: {why}", flush=True)
            continue
        with tempfile.TemporaryDirectory() as folder:
            row = row_of(case, case.make(Path(folder), told.workers))
        text = written(path, [row], {})  # now, as the next one may take an hour
        print(f"{case.name}: {row['verdict']}, {row['seconds']:.0f} s", flush=True)
    print(f"\n{text}\nwrote {path} and real.md")


if __name__ == "__main__":
    main()
