"""Where on the object the error sits: the points in their first shape, coloured by error over all time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from ...core.arrays import FloatArray
from .findings import Take
from .style import AFTER, BEFORE, ERROR_MAP, INK, RULE, SOFT, bare, look, new_figure, svg
from .words import shown_unit

_MOST_BARS = 12


def flat_layout(points: FloatArray) -> FloatArray:
    """Points ``(P, A)`` on the plane ``(P, 2)`` in which they spread most; up stays up, or else x stays right."""
    known = np.isfinite(points).all(axis=1)
    centred = points - points[known].mean(axis=0)
    if points.shape[1] == 2:
        return np.asarray(centred)
    normal = np.linalg.svd(centred[known], full_matrices=True)[2][2]
    up = np.array([0.0, 0.0, 1.0]) - normal[2] * normal
    if np.linalg.norm(up) > 0.3:
        up /= np.linalg.norm(up)
        right = np.cross(up, normal)
    else:
        right = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
        right /= np.linalg.norm(right)
        up = np.cross(normal, right)
        up = up if up[1] >= 0 else -up
    right = right if right[int(np.abs(right).argmax())] >= 0 else -right
    return np.stack([centred @ right, centred @ up], axis=1)


def points_figure(take: Take, index: int) -> str | None:
    """SVG: a map of the points, before and after, and a bar a point if they are few."""
    if (
        not take.correspondence
        or take.point_before is None
        or take.measured is None
        or len(take.point_before) != take.measured.shape[1]
        or not np.isfinite(take.point_before).any()
    ):
        return None
    factor, unit = shown_unit(take.unit)
    before = take.point_before * factor
    after = take.point_after * factor if take.point_after is not None and take.after is not None else None
    seen = np.isfinite(take.measured).all(axis=2)
    first = int(seen.sum(axis=1).argmax())
    places = take.measured if seen.any() else take.predicted  # of falling balls the height alone is seen
    if places is None:
        return None
    place = flat_layout(places[first])
    maps = [before] if after is None else [before, after]
    norm = Normalize(0.0, max(float(np.nanmax(before)), 4.0 * (take.noise or 0.0) * factor))
    with look(f"points{index}"):
        figure = new_figure(5.4, 2.7)
        grid = figure.subplots(1, len(maps) + 1, width_ratios=[1.0] * len(maps) + [0.85])
        size = float(np.clip(2600 / len(before), 12, 90))
        for axes, values, title in zip(grid, maps, ("before", "after"), strict=False):
            axes.scatter(
                *place.T, c=values, s=size, cmap=ERROR_MAP, norm=norm, edgecolors=SOFT, linewidths=0.35, clip_on=False
            )
            axes.set_aspect("equal", adjustable="datalim")
            axes.margins(0.1)
            axes.set_title(title, color=INK)
            bare(axes)
        _mark_worst(grid[0], place, before)
        _ranked(grid[-1], before, after, unit)
        drawn = figure.colorbar(
            ScalarMappable(norm, ERROR_MAP), ax=list(grid[:-1]), location="bottom", shrink=0.7, aspect=30, pad=0.03
        )
        drawn.outline.set_visible(False)
        drawn.set_label(f"error of a point over all time [{unit}]", color=SOFT)
        drawn.ax.tick_params(length=0)
        return svg(figure, f"error of each point of recording {take.name}")


def _mark_worst(axes: Axes, place: FloatArray, before: FloatArray) -> None:
    worst = int(np.nanargmax(before))
    axes.annotate(
        f"point {worst}", place[worst], xytext=(0, -11), textcoords="offset points", ha="center", va="top", fontsize=7.5
    )


def _ranked(axes: Axes, before: FloatArray, after: FloatArray | None, unit: str) -> None:
    """The worst points as bars, worst on top."""
    order = np.argsort(-np.nan_to_num(before))[:_MOST_BARS]
    y = np.arange(len(order))[::-1]
    axes.barh(y, before[order], height=0.62, color=BEFORE, linewidth=0)
    if after is not None:
        axes.barh(y, after[order], height=0.28, color=AFTER, linewidth=0)
    axes.set_yticks(y, [f"point {p}" for p in order], fontsize=7)
    axes.tick_params(length=0)
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x", color=RULE, linewidth=0.5)
    axes.set_axisbelow(True)
    axes.set_xlabel(f"[{unit}]")
    title = "worst points" if len(before) > len(order) else "every point"
    axes.set_title(title, color=INK)
