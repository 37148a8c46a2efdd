"""Pictures of a calibration: ranks, coverage, and the measurement among what the posterior predicts."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter

from ...core.arrays import FloatArray
from .style import AFTER, BEFORE, INK, NOISE, RULE, SOFT, look, new_figure, svg
from .words import words

#: Most bars of a rank histogram; fewer where cases are few.
_BARS = 20
_DRAWS = 20_000


def _band(share: FloatArray, cases: float) -> FloatArray:
    """Between which a share of calibrated cases lies 95 times in 100, at each place, ``(2, ...)``."""
    count = max(round(cases), 1)
    drawn = np.random.default_rng(0).binomial(count, share, (_DRAWS, *share.shape))
    return np.asarray(np.quantile(drawn / count, [0.025, 0.975], axis=0))


def rank_figure(name: str, ranks: FloatArray, weights: FloatArray, cases: float, index: int) -> str:
    """SVG of the ranks of one parameter, flat where it is calibrated.

    Args:
        name: of the parameter.
        ranks, weights: of the cases ``(N,)``.
        cases: what they are worth.
        index: of the picture in its page.
    """
    bars = int(np.clip(cases // 12, 5, _BARS))
    share, edges = np.histogram(ranks, bars, (0.0, 1.0), weights=weights / weights.sum())
    low, high = _band(np.array([1.0 / bars]), cases)
    with look(f"ranks{index}"):
        figure = new_figure(3.5, 1.9)
        axes = figure.add_subplot()
        axes.axhspan(bars * float(low[0]), bars * float(high[0]), color=NOISE, linewidth=0, alpha=0.7)
        axes.axhline(1.0, color=SOFT, linewidth=0.8)
        outside = (share < low[0]) | (share > high[0])
        colours = [BEFORE if o else AFTER for o in outside]
        axes.bar(edges[:-1], bars * share, 1.0 / bars, align="edge", color=colours, alpha=0.85, linewidth=0)
        for edge in edges[1:-1]:
            axes.axvline(edge, color="white", linewidth=0.8)
        axes.set_xlim(0, 1)
        axes.set_ylim(0, max(2.0, 1.08 * bars * float(share.max())))
        axes.set_xticks([0.1, 0.5, 0.9], ["truth below", "in the middle", "truth above"])
        axes.set_yticks([0, 1, 2])
        axes.tick_params(length=0)
        return svg(figure, f"ranks of the truth in the posterior of {words(name)}")


def coverage_figure(
    region: FloatArray, tarp: FloatArray, parameter: FloatArray, weights: FloatArray, cases: float
) -> str:
    """SVG of how much regions hold against how much they should.

    Args:
        region, tarp: ranks of the cases ``(N,)``.
        parameter: ranks of the cases in each parameter ``(N, D)``.
        weights: of the cases ``(N,)``.
        cases: what they are worth.
    """
    level = np.linspace(0.0, 1.0, 101)
    with look("coverage"):
        figure = new_figure(4.6, 4.2)
        axes = figure.add_subplot()
        low, high = _band(level, cases)
        axes.fill_between(level, low, high, color=NOISE, linewidth=0, alpha=0.7, label="95 % of calibrated ones")
        axes.plot(level, level, color=SOFT, linewidth=0.8)
        for k, ranks in enumerate(np.abs(2 * parameter - 1).T):
            label = "intervals of one parameter" if k == 0 else None
            axes.plot(level, _held(ranks, weights, level), color=INK, linewidth=0.7, alpha=0.45, label=label)
        axes.plot(level, _held(tarp, weights, level), color=AFTER, linewidth=1.4, linestyle=(0, (4, 2)), label="TARP")
        axes.plot(level, _held(region, weights, level), color=BEFORE, linewidth=1.8, label="highest-density regions")
        axes.text(0.97, 0.06, "over-confident: regions hold too little", ha="right", color=SOFT, fontsize=8)
        axes.text(0.03, 0.62, "under-\nconfident", ha="left", color=SOFT, fontsize=8)
        axes.set(xlim=(0, 1), ylim=(0, 1), xlabel="mass that a region should hold", ylabel="truths that it holds")
        axes.set_aspect("equal")
        for side in (axes.xaxis, axes.yaxis):
            side.set_major_formatter(PercentFormatter(1.0, decimals=0))
        _grid(axes)
        handles, labels = axes.get_legend_handles_labels()
        axes.legend(handles[::-1], labels[::-1], fontsize=7.5, loc="upper left", borderaxespad=0.3)
        return svg(figure, "share of truths held by regions against the mass that they should hold")


def _held(ranks: FloatArray, weights: FloatArray, level: FloatArray) -> FloatArray:
    order = np.argsort(ranks)
    total = np.concatenate([[0.0], np.cumsum(weights[order]) / weights.sum()])
    return np.asarray(total[np.searchsorted(ranks[order], level, side="right")])


def predictive_figure(rows: list[Mapping[str, float | str]], replicates: list[FloatArray]) -> str:
    """SVG of the measurements among their replicates, a line a recording."""
    with look("predictive"):
        figure = new_figure(6.2, 0.75 + 0.42 * len(rows))
        axes = figure.add_subplot()
        for k, (row, values) in enumerate(zip(rows, replicates, strict=True)):
            jitter = np.random.default_rng(k).uniform(-0.22, 0.22, len(values))
            axes.plot(values, k + jitter, ".", color=SOFT, markersize=2.5, alpha=0.35, markeredgewidth=0)
            colour = BEFORE if row["finding"] else INK
            axes.plot([float(row["measured"])] * 2, [k - 0.34, k + 0.34], color=colour, linewidth=2.2)
        axes.set_yticks(range(len(rows)), [f"{row['recording']}, {row['role']}" for row in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlabel("distance from the mean prediction [sd of prediction and noise]")
        _grid(axes, "x")
        axes.spines["left"].set_visible(False)
        return svg(figure, "distance of each measurement and of its replicates from the mean prediction")


def _grid(axes: Axes, which: str = "both") -> None:
    axes.grid(axis="x" if which == "x" else "both", color=RULE, linewidth=0.5, zorder=0)
    axes.set_axisbelow(True)
    axes.tick_params(length=0, colors=SOFT)
