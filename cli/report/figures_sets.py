"""Points as sets: their discrepancy over time, and where more or fewer were measured than predicted at the worst."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, TwoSlopeNorm
from matplotlib.ticker import MaxNLocator

from ...core.arrays import FloatArray
from .compared import Compared, view_name
from .findings import Take
from .style import AFTER, BEFORE, INK, NOISE, RULE, SOFT, bare, data_uri, look, new_figure, png

#: From where less was measured than predicted to where more was.
_WITNESS = LinearSegmentedColormap.from_list("witness", [BEFORE, "#e9b59f", "#fbfaf8", "#94c2bf", AFTER])


def sets_figure(take: Take) -> str | None:
    """PNG address: discrepancy over time, and the witness in each view; None if nothing is known."""
    c = take.compared
    if c is None or take.measured is None or not np.isfinite(c.sets.mmd).any():
        return None
    views = len(c.views)
    with look("sets"):
        figure = new_figure(4.2 + 3.1 * views, 2.9)
        spots = figure.subplots(1, 1 + views, width_ratios=[1.35] + [1.0] * views)
        _over_time(spots[0], take, c)
        top = max(float(np.abs(c.sets.witness).max()), 2 * float(c.sets.limit.max()), 1e-12)
        for w, axes in enumerate(spots[1:]):
            _witness(axes, c, w, take.measured[c.sets.worst], top)
        return data_uri(png(figure, 140))


def _over_time(axes: Axes, take: Take, c: Compared) -> None:
    s, time = c.sets, take.time
    axes.fill_between(time, 0, s.threshold, color=NOISE, linewidth=0, zorder=1)
    axes.plot(time, s.mmd, color=BEFORE, linewidth=1.5, zorder=3)
    axes.axvline(time[s.worst], color=INK, linewidth=0.6, linestyle=(0, (2, 3)), zorder=2)
    axes.set_xlim(float(time[0]), float(time[-1]))
    axes.set_ylim(0, 1.1 * float(np.nanmax([np.nanmax(s.mmd), np.nanmax(s.threshold)])))
    axes.set_xlabel("time [s]")
    axes.set_ylabel("discrepancy (MMD) [1]")
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.grid(axis="y", color=RULE, linewidth=0.5, zorder=0)
    axes.tick_params(length=0)
    axes.set_title("grey: what noise alone gives", color=SOFT, loc="left")


def _witness(axes: Axes, c: Compared, w: int, measured: FloatArray, top: float) -> None:
    s, rows = c.sets, c.views[w]
    (x0, y0), (x1, y1) = s.low[w], s.high[w]
    extent = (float(x0), float(x1), float(y0), float(y1))
    axes.imshow(
        s.witness[w], origin="lower", extent=extent, cmap=_WITNESS, norm=TwoSlopeNorm(0.0, -top, top), aspect="equal"
    )
    grid_x, grid_y = (np.linspace(a, b, s.witness.shape[2]) for a, b in ((x0, x1), (y0, y1)))
    beyond = [level for level in (-s.limit[w], s.limit[w]) if s.witness[w].min() < level < s.witness[w].max()]
    if beyond:
        axes.contour(grid_x, grid_y, s.witness[w], levels=beyond, colors=SOFT, linewidths=0.7, linestyles="solid")
    predicted = c.predicted[s.worst] @ rows.T
    axes.scatter(predicted[:, 0], predicted[:, 1], s=9, facecolors="none", edgecolors=BEFORE, linewidths=0.8)
    real = measured @ rows.T
    axes.scatter(real[:, 0], real[:, 1], s=7, color=INK, linewidths=0)
    axes.set_xlim(extent[0], extent[1])
    axes.set_ylim(extent[2], extent[3])
    axes.set_title(view_name(rows), color=SOFT, fontsize=8)
    bare(axes)
