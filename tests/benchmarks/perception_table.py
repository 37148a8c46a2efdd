"""Print the tables of docs/perception.md from what ``make bench-perception`` wrote to ``results/``."""

import json
import re
from collections.abc import Iterator
from typing import Any

from table import RESULTS

Rows = dict[str, dict[str, Any]]


def _rows(name: str) -> Rows:
    return {r["figure"]: r for r in json.loads((RESULTS / f"{name}.json").read_text())["rows"]}


def _groups(rows: Rows, pattern: str) -> Iterator[tuple[re.Match[str], dict[str, Any]]]:
    """Beginnings of figures that match, each with the rest of its figures and their values."""
    seen: dict[str, tuple[re.Match[str], dict[str, Any]]] = {}
    for figure, row in rows.items():
        what, _, rest = figure.partition(": ")
        if match := re.fullmatch(pattern, what):
            seen.setdefault(what, (match, {}))[1][rest] = row["value"]
    yield from seen.values()


def heatmap() -> list[str]:
    """Errors of ``heatmap`` on draws that it has not seen."""
    lines = [
        "| scenario | learned from | looks at | median [px] | 90 % below [px] | seen ones lost | hidden ones NaN |"
    ]
    lines.append("|---" * 7 + "|")
    for match, found in _groups(_rows("perception"), r"heatmap (\w+), (\w+) to (\w+)"):
        hidden = next((k, v) for k, v in found.items() if k.startswith("hidden"))
        lines.append(
            f"| `{match[1]}` | {match[2]} | {match[3]} | {found['median error']:.1f} "
            f"| {found['90 % of errors below']:.1f} | {100 * found['seen keypoints lost']:.0f} % "
            f"| {hidden[1] if isinstance(hidden[1], str) else f'{100 * hidden[1]:.0f} %'} |"
        )
    return lines


def transporter() -> list[str]:
    """What ``transporter`` finds, with and without a robot, beside a fixed grid."""
    lines = [
        "| scenario | K | focus | robot | at its own spot (grid) | on the object (grid) | given | Chamfer (grid) [px] |"
    ]
    lines.append("|---" * 8 + "|")
    pattern = r"transporter (\w+), (\d+) keypoints(?:, focus ([\d.]+))?, (no robot|robot .*)"
    for match, found in _groups(_rows("perception"), pattern):
        near = found["Chamfer to the object's pixels"]
        share = {k: f"{100 * v:.0f} %" for k, v in found.items()}
        lines.append(
            f"| `{match[1]}` | {match[2]} | {match[3] or 0} | {match[4]} "
            f"| {share['within 10 px of its own spot']} ({share['a fixed grid within 10 px of its own spots']}) "
            f"| {share['on the object, of those given']} ({share['a fixed grid on the object']}) | {share['given']} "
            f"| {near:.1f} ({found['Chamfer of a fixed grid']:.1f}) |"
        )
    return lines


def study() -> list[str]:
    """The fling from its pictures to its posterior."""
    rows = _rows("perception-study")
    lines = [
        "| draw | points | posterior mean to markers' (prior) | fling's mask (prior) [px] | swing's mask (prior) [px] |"
    ]
    lines.append("|---" * 5 + "|")
    for match, found in _groups(rows, r"fling from (\w+), draw (\d+)"):
        what = match[0]
        cells = []
        for name in ("posterior mean to that of markers", "Chamfer of the fling", "Chamfer of the swing"):
            if name not in found:
                cells.append("–")
                continue
            prior = re.match(r"< ([\d.]+)", rows[f"{what}: {name}"]["goal"])
            assert prior is not None
            cells.append(f"{found[name]:.2f} ({float(prior[1]):.2f})")
        lines.append(f"| {match[2]} | `{match[1]}` | {' | '.join(cells)} |")
    return lines


def main() -> None:
    print("\n".join([*heatmap(), "", *transporter(), "", *study()]))


if __name__ == "__main__":
    main()
