"""The page about several simulators under the same draws."""

from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from ...core.arrays import FloatArray, IntArray
from ...core.comparison import SimulatorComparison, SimulatorRun
from ...core.comparison.result import told
from ...core.store import write_text
from .figures_object import Snapshot, best_view
from .style import AFTER, BEFORE, INK, RULE, SCATTER, SOFT, bare, data_uri, look, new_figure, png, svg

#: Colours of the simulators, in their order.
COLOURS = (BEFORE, AFTER, "#4a5d9e", "#8a6d1f", "#7a3b69")


def write_simulator_report(found: SimulatorComparison, edges: IntArray, path: Path) -> Path:
    """Write one self-contained HTML file.

    Args:
        found: to show.
        edges: of the mesh ``(N, 2)``, to draw it.
        path: the file.
    """
    environment = Environment(
        loader=PackageLoader("muslin.cli"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters["told"] = told
    write_text(path, environment.get_template("simulators.html.j2").render(_context(found, edges)))
    return path


def _context(found: SimulatorComparison, edges: IntArray) -> dict[str, Any]:
    table = found.to_json()
    return {
        "found": table,
        "pairs": [_pair(found, a, b, edges, i) for i, (a, b) in enumerate(found.pairs)],
        "sensitivity": _sensitivity_figure(found),
        "parameters": list(found.space),
        "too_few": found.too_few,
        "colours": dict(zip([r.name for r in found.runs], COLOURS, strict=False)),
    }


def _pair(
    found: SimulatorComparison, one: SimulatorRun, other: SimulatorRun, edges: IntArray, i: int
) -> dict[str, Any]:
    apart = found.difference(one, other)
    size = np.sqrt(np.mean(apart**2, axis=1))
    both = np.flatnonzero(np.isfinite(size))
    shots = []
    if len(both):
        ranked = both[np.argsort(size[both])]
        chosen = {"the median draw": ranked[(len(ranked) - 1) // 2], "the draw they disagree on most": ranked[-1]}
        for title, draw in chosen.items() if len(ranked) > 1 else [("the only draw", ranked[0])]:
            shots.append(
                {"title": title, "drawn": _values(found, draw), **_shot(found, one, other, draw, apart, edges)}
            )
    return {
        "names": (one.name, other.name),
        "median": float(np.median(size[both])) if len(both) else None,
        "both": len(both),
        "over_time": _time_figure(found, one, other, apart, i) if len(both) else "",
        "regions": _region_figure(found, size, i) if len(both) else "",
        "shots": shots,
    }


def _values(found: SimulatorComparison, draw: int) -> str:
    values = found.space.from_unit(found.unit_draws[draw])
    return ", ".join(
        f"{p.name} {v:.3g} {p.unit if p.unit != '1' else ''}".strip() for p, v in zip(found.space, values, strict=True)
    )


def _time_figure(found: SimulatorComparison, one: SimulatorRun, other: SimulatorRun, apart: FloatArray, i: int) -> str:
    with look(f"time{i}"):
        figure = new_figure(5.4, 2.6)
        axes = figure.add_subplot()
        low, middle, high = 1000 * np.nanpercentile(apart, [10, 50, 90], axis=0)
        axes.fill_between(found.times, low, high, color=SCATTER, linewidth=0)
        axes.plot(found.times, middle, color=INK, linewidth=1.6)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("distance [mm]")
        axes.set_ylim(0)
        axes.set_xlim(float(found.times[0]), float(found.times[-1]))
        _quiet(axes)
        return svg(figure, f"distance between {one.name} and {other.name} over time")


def _region_figure(found: SimulatorComparison, size: FloatArray, i: int) -> str:
    values = found.space.from_unit(found.unit_draws)
    with look(f"region{i}"):
        figure = new_figure(2.7 * len(found.space), 2.4)
        spots = figure.subplots(1, len(found.space), squeeze=False, sharey=True)[0]
        for p, (axes, parameter) in enumerate(zip(spots, found.space, strict=True)):
            axes.scatter(values[:, p], 1000 * size, s=12, color=INK, linewidths=0, alpha=0.75)
            axes.set_xscale(parameter.scale)
            axes.set_xlabel(f"{parameter.name} [{parameter.unit}]")
            axes.set_ylim(0)
            _quiet(axes)
        spots[0].set_ylabel("distance [mm]")
        return svg(figure, "distance between the simulators against every parameter")


def _sensitivity_figure(found: SimulatorComparison) -> str:
    """Nothing where it cannot be told for any simulator."""
    if not any(np.isfinite(r.sensitivity(found.unit_draws)[0]).any() for r in found.runs):
        return ""
    with look("sensitivity"):
        figure = new_figure(5.4, 0.55 + 0.5 * len(found.space))
        axes = figure.add_subplot()
        height = 0.8 / len(found.runs)
        for k, run in enumerate(found.runs):
            size = np.nan_to_num(1000 * run.sensitivity(found.unit_draws)[0])
            rows = np.arange(len(found.space)) + (k - (len(found.runs) - 1) / 2) * height
            axes.barh(rows, size, height * 0.86, color=COLOURS[k % len(COLOURS)], label=run.name)
        axes.set_yticks(np.arange(len(found.space)), [p.name for p in found.space])
        axes.invert_yaxis()
        axes.set_xlabel("how far a vertex moves when the parameter crosses its prior [mm]")
        axes.legend(fontsize=8)
        _quiet(axes, "x")
        return svg(figure, "sensitivity of every simulator to every parameter")


def _shot(
    found: SimulatorComparison, one: SimulatorRun, other: SimulatorRun, draw: int, apart: FloatArray, edges: IntArray
) -> dict[str, Any]:
    frame = int(np.argmax(apart[draw]))
    points = [one.vertices[draw, frame], other.vertices[draw, frame]]
    view = best_view([Snapshot("", points[0], points[1], points[0], None)])[:2]
    names = [r.name for r in found.runs]
    with look():
        figure = new_figure(4.4, 3.8)
        axes = figure.add_subplot()
        for run, place in zip((one, other), points, strict=True):
            flat = place @ view.T
            colour = COLOURS[names.index(run.name) % len(COLOURS)]
            width = 1.8 if found.kind == "rope" else 0.7
            axes.add_collection(LineCollection(list(flat[edges]), colors=colour, linewidths=width, alpha=0.85))
        everything = np.concatenate(points) @ view.T
        low, high = everything.min(axis=0), everything.max(axis=0)
        margin = 0.05 * float((high - low).max()) + 1e-6
        axes.set_xlim(float(low[0] - margin), float(high[0] + margin))
        axes.set_ylim(float(low[1] - margin), float(high[1] + margin))
        axes.set_aspect("equal")
        bare(axes)
        image = data_uri(png(figure, 150))
    return {"image": image, "time": float(found.times[frame]), "apart": float(apart[draw, frame])}


def _quiet(axes: Axes, grid: str = "y") -> None:
    axes.grid(axis="x" if grid == "x" else "y", color=RULE, linewidth=0.5, zorder=0)
    axes.set_axisbelow(True)
    axes.tick_params(length=0, colors=SOFT)
