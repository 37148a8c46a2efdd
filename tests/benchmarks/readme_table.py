"""Print the README's tables from what the benchmarks wrote to ``results/``."""

import json
from typing import Any

from effects_batches import together
from table import RESULTS

SIMULATORS = ("mujoco", "pybullet")


def hidden_effects() -> list[str]:
    """Which effect was hidden, and what was said of it."""
    content = json.loads((RESULTS / "hidden-small.json").read_text())
    rows = {r["figure"]: r["value"] for r in content["rows"]}
    lines = ["| hidden | verdict | held-out error [mm] |", "|---|---|---|"]
    for figure, told in rows.items():
        if not figure.endswith(": verdict"):
            continue
        hidden = figure.removeprefix("hidden ").removesuffix(": verdict")
        verdict, effects = told.split(": ")
        says = verdict if effects == "-" else f"{verdict}: `{effects}`"
        before, after = (rows[f"hidden {hidden}: held-out error {when}"] for when in ("before", "after"))
        lines.append(f"| {hidden if hidden == 'none' else f'`{hidden}`'} | {says} | {before:.1f} → {after:.1f} |")
    return lines


def materials() -> list[str]:
    """Delivered against asked by group of virtual tests: the worst error on the finest mesh, and goals met."""
    found = {s: json.loads((RESULTS / f"material-{s}.json").read_text())["rows"] for s in SIMULATORS}
    groups = dict.fromkeys(r["group"] for rows in found.values() for r in rows if r["goal"] is not None)
    lines = [f"| virtual tests | {' | '.join(f'`{s}`' for s in SIMULATORS)} |", "|---|---|---|"]
    return lines + [
        f"| {g} | {' | '.join(_cell([r for r in found[s] if r['group'] == g]) for s in found)} |" for g in groups
    ]


def _cell(rows: list[dict[str, Any]]) -> str:
    judged = [r for r in rows if r["goal"] is not None and r["claimed"]]
    if not judged:
        return "not claimed"
    errors = [abs(r["error"]) for r in judged if r["error"] is not None and r["asked"]]
    met = sum(r["status"] == "met" for r in judged)
    return f"{100 * max(errors):.1f} %, {met} of {len(judged)} met" if errors else f"{met} of {len(judged)} met"


def posteriors() -> list[str]:
    """How far estimators are from known posteriors, and the processor seconds of their training."""
    table = json.loads((RESULTS / "inference.json").read_text())["table"]
    methods = list(dict.fromkeys(r["method"] for r in table))
    lines = [f"| task, simulations | {' | '.join(f'`{m}`' for m in methods)} |", "|---" * (len(methods) + 1) + "|"]
    for task, simulations in dict.fromkeys((r["task"], r["simulations"]) for r in table):
        cells = [_posterior(r) for r in table if (r["task"], r["simulations"]) == (task, simulations)]
        lines.append(f"| {task}, {simulations} | {' | '.join(cells)} |")
    return lines


def _posterior(row: dict[str, Any]) -> str:
    return "–" if row["c2st"] is None else f"{row['c2st']:.3f}, {row['train_cpu_s']:.0f} s"


def real_recordings() -> list[str]:
    """Held-out errors on real recordings, with the default simulator; of the cloths seen as clouds one each."""
    rows = json.loads((RESULTS / "real.json").read_text())["rows"]
    lines = [
        "| held-out error [mm] | carried along | unfitted | fitted | with what was named | verdict |",
        "|---" * 6 + "|",
    ]
    for r in rows:
        if "PyBullet" in r["set"] or (r["set"].startswith("cloud") and "paper" not in r["set"]):
            continue
        lengths = ("–" if r[c] is None else _millimetres(r[c]) for c in ("baseline", "unfitted", "fitted", "after"))
        lines.append(f"| {r['set']} | {' | '.join(lengths)} | {r['verdict'].removesuffix(': -')} |")
    return lines


def _millimetres(length: float) -> str:
    return f"{1e3 * length:.0f}" if length >= 0.1 else f"{1e3 * length:.1f}"


def main() -> None:
    print(
        "\n\n".join("\n".join(t) for t in (hidden_effects(), together(), materials(), posteriors(), real_recordings()))
    )


if __name__ == "__main__":
    main()
