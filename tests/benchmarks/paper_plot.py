"""The protocol's figures and table: distance to what really happened against the round, one panel a scenario."""

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from paper_loop import Cell, Plan, Score

Found = Mapping[Cell, list[Score]]

COLOURS = {
    "bayessim-mdnn": "#4a5d9e",
    "bayessim-mdrff": "#8a6d1f",
    "bayessim-rkhs": "#c44832",
    "bayeszoom": "#6f8f5b",
    "bayeszoom-rkhs": "#7a3b69",
    "nn-bulk": "#777777",
    "gp-bulk": "#aaaaaa",
    "npe-rkhs": "#1c1c1c",
}


def told(found: Found) -> str:
    """The last round of every method as a table; distances are means over seeds and evaluation trajectories."""
    lines = ["", f"{'scenario':9s} {'reality':8s} {'K':>2s} {'method':16s} {'distance [px]':>16s}  log density"]
    for group in sorted({(c.scenario, c.reality, c.keypoints) for c in found if c.keypoints}):
        bounds = [s for c, s in found.items() if (c.scenario, c.reality, c.keypoints) == (*group[:2], 0)]
        start = f"{group[0]:9s} {group[1]:8s} {group[2]:2d}"
        if bounds:
            prior, truth = (np.mean([b[k].distance for b in bounds]) for k in (0, 1))
            lines.append(f"{start} {'prior':16s} {prior:9.2f}         {0.0:8.2f}")
            lines.append(f"{start} {'truth':16s} {truth:9.2f}")
        for method in COLOURS:
            last = [s[-1] for c, s in found.items() if c.method == method and c[:3] == group]
            if last:
                apart, spread = (np.mean([getattr(s, k) for s in last]) for k in ("distance", "deviation"))
                density = np.mean([s.log_prob for s in last])
                lines.append(f"{start} {method:16s} {apart:9.2f} +- {spread:5.2f} {density:8.2f}")
    return "\n".join(lines)


def draw(found: Found, plan: Plan, stem: Path) -> list[Path]:
    """One picture for every reality and K; returns the files."""
    files = []
    for reality, count in sorted({(c.reality, c.keypoints) for c in found if c.keypoints}):
        scenarios = list(dict.fromkeys(c.scenario for c in found if (c.reality, c.keypoints) == (reality, count)))
        figure, panels = plt.subplots(
            1, len(scenarios), figsize=(4.2 * len(scenarios), 3.4), squeeze=False, layout="constrained"
        )
        for axes, scenario in zip(panels[0], scenarios, strict=True):
            here = {c: s for c, s in found.items() if (c.scenario, c.reality) == (scenario, reality)}
            _panel(axes, here, count, plan)
            axes.set_title(
                f"{scenario}, K = {count}, reality in {'the same' if reality == 'same' else 'another'} engine"
            )
        panels[0][0].set_ylabel("distance to what really happened [px]")
        panels[0][-1].legend(fontsize=7, frameon=False)
        file = stem.with_name(f"{stem.name}_{reality}_{count}.png")
        figure.savefig(file, dpi=140)
        plt.close(figure)
        files.append(file)
    return files


def _panel(axes: Axes, here: Found, count: int, plan: Plan) -> None:
    rounds = np.arange(1, plan.iterations + 1)
    for method, colour in COLOURS.items():
        runs = [s for c, s in here.items() if c.method == method and c.keypoints == count]
        if not runs:
            continue
        mean = np.mean([[s.distance for s in scores] for scores in runs], axis=0)
        spread = np.mean([[s.deviation for s in scores] for scores in runs], axis=0)
        if len(mean) == 1:  # trained once
            axes.axhline(mean[0], color=colour, linestyle="--", linewidth=1.2, label=method)
            continue
        axes.plot(rounds, mean, color=colour, linewidth=1.5, label=method)
        axes.fill_between(rounds, mean - spread, mean + spread, color=colour, alpha=0.12, linewidth=0)
    for k, (name, style) in enumerate((("prior", ":"), ("truth", "-."))):
        levels = [s[k].distance for c, s in here.items() if c.method == "bounds"]
        if levels:
            axes.axhline(float(np.mean(levels)), color="black", linestyle=style, linewidth=0.8, label=name)
    axes.set_xlabel(f"rounds of {plan.per_iteration} draws")
    axes.set_ylim(0)
    axes.set_xticks(rounds[:: max(1, plan.iterations // 5)])
