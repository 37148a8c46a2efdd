"""Error over time: before, after, and what noise and the posterior allow."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from .findings import Take
from .style import AFTER, BEFORE, INK, NOISE, RULE, SCATTER, SOFT, look, new_figure, svg
from .words import shown_unit


def error_ceiling(takes: list[Take]) -> float:
    """A common top of the error axis, in the unit that is shown."""
    tops = []
    for t in takes:
        lines = [t.before] if t.after is None else [t.before, t.after]
        highest = max([float(np.nanmax(line)) for line in lines] + [2.0 * (t.noise or 0.0)])
        tops.append(highest * shown_unit(t.unit)[0])
    return 1.12 * max([*tops, 1e-9])


def draw_error(axes: Axes, take: Take, top: float, *, mark: bool = True) -> None:
    """Error of one recording over time on ``axes``."""
    factor, unit = shown_unit(take.unit)
    noise = (take.noise or 0.0) * factor
    t = take.time
    if take.scatter is not None:
        allowed = np.sqrt(noise**2 + (np.nan_to_num(take.scatter) * factor) ** 2)
        axes.fill_between(t, noise, allowed, color=SCATTER, linewidth=0, zorder=1)
    if noise > 0:
        axes.axhspan(0, noise, color=NOISE, linewidth=0, zorder=2)
    axes.plot(t, take.before * factor, color=BEFORE, linewidth=1.6, zorder=4, solid_capstyle="round")
    if take.after is not None:
        axes.plot(t, take.after * factor, color=AFTER, linewidth=1.6, zorder=5, solid_capstyle="round")
    if mark:
        k = take.worst_frame
        axes.axvline(t[k], color=INK, linewidth=0.6, linestyle=(0, (2, 3)), zorder=3)
        late = t[k] > t[0] + 0.72 * (t[-1] - t[0])
        label: dict[str, Any] = {"xytext": (-4 if late else 4, -1), "ha": "right" if late else "left", "va": "top"}
        axes.annotate(
            f"worst, {t[k]:.2f} s", (t[k], top), textcoords="offset points", fontsize=7.5, color=SOFT, zorder=6, **label
        )
    axes.set_xlim(float(t[0]), float(t[-1]))
    axes.set_ylim(0, top)
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"error [{unit}]")
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.grid(axis="y", color=RULE, linewidth=0.5, zorder=0)
    axes.set_axisbelow(True)
    axes.tick_params(length=0)


def error_figure(take: Take, top: float, index: int) -> str:
    """SVG of one recording."""
    with look(f"error{index}"):
        figure = new_figure(5.4, 2.5)
        draw_error(figure.add_subplot(), take, top)
        return svg(figure, f"error over time of recording {take.name}")
