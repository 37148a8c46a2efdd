"""Error over time and place at once: a row a point, a column a frame, and above it what the object was doing."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize

from .compared import Compared, distance
from .figures_object import heat_top
from .findings import Take
from .style import ERROR_MAP, INK, SOFT, data_uri, look, new_figure, png
from .words import shown_unit

_PHASES = ListedColormap(["#eef0ee", "#cfd6d9", "#8f9ba3", "#5f7fa8"])


def map_figure(take: Take) -> str | None:
    """PNG address; None where points do not correspond, because rows would mean nothing."""
    c = take.compared
    if c is None or not take.correspondence or c.difference.shape[:2] != c.predicted.shape[:2]:
        return None
    factor, unit = shown_unit(take.unit)
    error = distance(c.difference) * factor
    known = c.distance is not None and np.isfinite(c.distance).all()
    order = np.argsort(c.distance, kind="stable") if known and c.distance is not None else np.arange(error.shape[1])
    norm = Normalize(0.0, heat_top(error / factor, take.noise) * factor)
    span = (float(take.time[0]), float(take.time[-1]))
    with look("map"):
        figure = new_figure(5.4, 2.9)
        strip, axes = figure.subplots(2, 1, height_ratios=[0.07, 1.0], sharex=True)
        _phases(strip, c, span)
        axes.set_facecolor("#ffffff")
        axes.imshow(
            error.T[order], aspect="auto", origin="upper", cmap=ERROR_MAP, norm=norm, interpolation="nearest",
            extent=(*span, len(order) - 0.5, -0.5),
        )  # fmt: skip
        axes.set_xlabel("time [s]")
        axes.set_ylabel("far from the grasp  ←  points  →  near" if known else "point")
        axes.set_yticks([])
        axes.tick_params(length=0)
        drawn = figure.colorbar(ScalarMappable(norm, ERROR_MAP), ax=[strip, axes], pad=0.02, aspect=28)
        drawn.outline.set_visible(False)
        drawn.set_label(f"distance [{unit}]", color=SOFT)
        drawn.ax.tick_params(length=0)
        return data_uri(png(figure, 130))


def _phases(axes: Axes, c: Compared, span: tuple[float, float]) -> None:
    axes.imshow(
        c.motion[None], aspect="auto", cmap=_PHASES, norm=Normalize(-0.5, 3.5), interpolation="nearest",
        extent=(*span, 0.5, -0.5),
    )  # fmt: skip
    axes.set_yticks([])
    axes.tick_params(length=0, labelbottom=False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    edges = np.flatnonzero(np.diff(c.motion)) + 1
    starts, ends = np.concatenate([[0], edges]), np.concatenate([edges, [len(c.motion)]])
    per = (span[1] - span[0]) / len(c.motion)
    for a, b in zip(starts, ends, strict=True):
        if (b - a) / len(c.motion) > 0.12:
            middle = span[0] + per * (a + b) / 2
            axes.text(middle, -0.75, c.phases[c.motion[a]], ha="center", va="bottom", fontsize=7.5, color=INK)
