"""What the fit knows about each parameter, and about pairs of them."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, NullLocator

from ...core.arrays import FloatArray
from .findings import Posterior
from .style import AFTER, BEFORE, INK, SOFT, look, new_figure, svg
from .words import words

_SHADE = "#f1efe8"


@dataclass(frozen=True, eq=False)
class Axis:
    """One parameter as an axis: its draws and prior range, on the scale of the prior."""

    name: str
    unit: str
    low: float
    high: float
    log: bool
    draws: FloatArray
    after: FloatArray | None = None
    estimate: float | None = None

    @property
    def label(self) -> str:
        return words(self.name) + ("" if self.unit in ("1", "-") else f" [{self.unit}]")

    def flat(self, values: FloatArray) -> FloatArray:
        """Values on the scale on which the prior is flat."""
        return np.log10(np.maximum(values, 1e-300)) if self.log else values


def axes_of(fit: Posterior, after: Posterior | None = None) -> list[Axis]:
    """Every parameter of ``fit``, then those that only ``after`` has."""
    out = []
    for source in [fit] if after is None else [fit, after]:
        for i, name in enumerate(source.names):
            if source is not fit and name in fit.names:
                continue
            a = source.attrs
            later = after.samples[:, after.names.index(name)] if after is not None and name in after.names else None
            first = source.samples[:, i] if source is fit else np.zeros(0)
            log = a["scale"][i] == "log"
            best = float(source.estimate[i])
            out.append(Axis(name, a["units"][i], float(a["low"][i]), float(a["high"][i]), log, first, later, best))
    return out


def density(draws: FloatArray, low: float, high: float, count: int = 240) -> tuple[FloatArray, FloatArray]:
    """Kernel estimate on ``[low, high]``, reflected at both ends so that mass at a bound stays visible."""
    x = np.linspace(low, high, count)
    kept = draws[np.isfinite(draws)][:4000]
    quartiles = np.subtract(*np.percentile(kept, [75, 25]))
    width = 0.9 * min(float(kept.std()), float(quartiles) / 1.34 or np.inf) * len(kept) ** -0.2
    width = max(width, (high - low) / 300)
    inside = np.clip(kept, low, high)
    folded = np.concatenate([inside, 2 * low - inside, 2 * high - inside])
    hist, edges = np.histogram(folded, 3 * count, (2 * low - high, 2 * high - low))
    centres = 0.5 * (edges[1:] + edges[:-1])
    y = np.exp(-0.5 * ((x[:, None] - centres) / width) ** 2) @ hist
    return x, np.asarray(y / (y.sum() * (x[1] - x[0]) + 1e-300))


def marginal_figure(axis: Axis, index: int) -> str:
    """SVG of one parameter's density over its shaded prior range."""
    with look(f"marginal{index}"):
        figure = new_figure(3.5, 1.75)
        axes = figure.add_subplot()
        low, high = axis.flat(np.array([axis.low, axis.high]))
        axes.axvspan(axis.low, axis.high, color=_SHADE, linewidth=0)
        for draws, colour in ((axis.draws, BEFORE), (axis.after, AFTER)):
            if draws is None or not len(draws):
                continue
            x, y = density(axis.flat(draws), low, high)
            at = 10**x if axis.log else x
            axes.fill_between(at, 0, y, color=colour, alpha=0.16, linewidth=0)
            axes.plot(at, y, color=colour, linewidth=1.4, solid_capstyle="round")
            axes.plot([np.mean(draws)], [0], "^", color=colour, markersize=5, clip_on=False, zorder=5)
        if axis.estimate is not None:
            axes.axvline(axis.estimate, color=INK, linewidth=0.9, linestyle=(0, (3, 2)), zorder=4)
        margin = 0.04 * (high - low)
        ends = np.array([low - margin, high + margin])
        if axis.log:
            axes.set_xscale("log")
            ends = 10**ends
        axes.set_xlim(float(ends[0]), float(ends[1]))
        axes.set_ylim(bottom=0)
        _ticks(axes, axis, "x")
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
        axes.set_xlabel(axis.label)
        return svg(figure, f"posterior density of {axis.name}")


def _ticks(axes: Axes, axis: Axis, which: str) -> None:
    side = axes.xaxis if which == "x" else axes.yaxis
    if axis.log:
        side.set_major_locator(LogLocator(numticks=5))
        side.set_minor_formatter(NullFormatter())
        side.set_minor_locator(NullLocator())
    else:
        side.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
    axes.tick_params(axis="x" if which == "x" else "y", length=2, width=0.5, color=SOFT)


def pair_figure(axes_list: list[Axis], limit: int = 4) -> str | None:
    """SVG of pairwise draws of the up to four most correlated parameters; None for a single one."""
    known = [a for a in axes_list if len(a.draws)]
    if len(known) < 2:
        return None
    if len(known) > limit:
        flat = np.stack([a.flat(a.draws) for a in known])
        strength = np.abs(np.nan_to_num(np.corrcoef(flat)) - np.eye(len(known))).max(axis=1)
        known = [known[i] for i in sorted(np.argsort(-strength)[:limit])]
    n = len(known) - 1
    with look("pairs"):
        figure = new_figure(1.0 + 1.75 * n, 0.7 + 1.6 * n)
        grid = figure.subplots(n, n, squeeze=False)
        for r in range(n):
            for c in range(n):
                axes = grid[r][c]
                if c > r:
                    axes.set_visible(False)
                    continue
                x, y = known[c], known[r + 1]
                keep = slice(0, 350)
                axes.scatter(x.draws[keep], y.draws[keep], s=5, color=INK, alpha=0.28, linewidths=0, rasterized=True)
                axes.set(xscale="log" if x.log else "linear", yscale="log" if y.log else "linear")
                _ticks(axes, x, "x")
                _ticks(axes, y, "y")
                _window(axes, x, y)
                axes.set_xlabel(x.label if r == n - 1 else "")
                axes.set_ylabel(y.label if c == 0 else "")
                axes.tick_params(labelbottom=r == n - 1, labelleft=c == 0)
        return svg(figure, "posterior draws of pairs of parameters")


def _window(axes: Axes, x: Axis, y: Axis) -> None:
    """The whole prior box, so that the eye sees how much of it is left."""
    for axis, setter in ((x, axes.set_xlim), (y, axes.set_ylim)):
        low, high = axis.flat(np.array([axis.low, axis.high]))
        ends = np.array([low, high]) + np.array([-0.05, 0.05]) * (high - low)
        ends = 10**ends if axis.log else ends
        setter(float(ends[0]), float(ends[1]))
    corner, width, height = (x.low, y.low), x.high - x.low, y.high - y.low
    axes.add_patch(Rectangle(corner, width, height, color=_SHADE, linewidth=0, zorder=0))
    axes.spines[["left", "bottom"]].set_visible(False)
