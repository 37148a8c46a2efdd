"""The motion to record next: where the grippers go, and when the models come apart on it."""

from collections.abc import Sequence
from typing import cast

import numpy as np
import zarr
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ...core.arrays import FloatArray
from ...core.store import read
from .style import AFTER, BEFORE, INK, NOISE, RULE, SOFT, look, new_figure, svg
from .words import words

_COLOURS = (BEFORE, AFTER, INK, SOFT, "#c79a2b", "#5b6fb0", "#8a4f7d", "#7d9b3c")


def motion_figure(proposed: zarr.Group, noise: float | None) -> str | None:
    """SVG of the results of ``next``; None if no motion is proposed.

    Args:
        proposed: what the step stored.
        noise: standard deviation of a coordinate [m]; None if it is in pixels.
    """
    if "predicted" not in proposed or "frame_time" not in proposed:
        return None
    poses, predicted = (np.asarray(read(proposed, name)) for name in ("gripper_pose", "predicted"))
    with look("motion"):
        figure = new_figure(9.2, 2.7)
        path, apart = figure.subplots(1, 2)
        _path(path, np.asarray(read(proposed, "time")), poses[..., :3])
        names = [str(name) for name in cast(Sequence[object], proposed.attrs["models"])]
        _apart(apart, np.asarray(read(proposed, "frame_time")), predicted, names, noise)
        return svg(figure, "displacement of the grippers over time, and how far the models' predictions are apart")


def _path(axes: Axes, time: FloatArray, positions: FloatArray) -> None:
    away = 1e3 * (positions - positions[:1])
    for g in range(away.shape[1]):
        for a, (axis, colour) in enumerate(zip("xyz", _COLOURS, strict=False)):
            label = axis if g == 0 else None
            axes.plot(time, away[:, g, a], color=colour, linewidth=1.4, linestyle=("-", "--", ":")[g % 3], label=label)
    several = f", {away.shape[1]} grippers" if away.shape[1] > 1 else ""
    _dress(axes, time, "gripper from its start [mm]", f"what the robot does{several}")


def _apart(axes: Axes, time: FloatArray, predicted: FloatArray, names: list[str], noise: float | None) -> None:
    """Root mean square distance over the points of every model to the first."""
    title = f"predictions beside those of {words(names[0])}"
    if noise is not None:
        axes.axhspan(0, 1e3 * noise * np.sqrt(predicted.shape[-1]), color=NOISE, linewidth=0, zorder=1)
        title += "; grey: noise of a point"
    for k in range(1, len(predicted)):
        distance = np.linalg.norm(predicted[k] - predicted[0], axis=-1)
        colour = _COLOURS[(k - 1) % len(_COLOURS)]
        axes.plot(time, 1e3 * np.sqrt(np.mean(distance**2, axis=1)), color=colour, linewidth=1.4, label=words(names[k]))
    axes.set_ylim(bottom=0)
    _dress(axes, time, "models apart [mm]", title)


def _dress(axes: Axes, time: FloatArray, label: str, title: str) -> None:
    axes.set_xlim(float(time[0]), float(time[-1]))
    axes.set_xlabel("time [s]")
    axes.set_ylabel(label)
    axes.set_title(title, color=SOFT, loc="left")
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.grid(axis="y", color=RULE, linewidth=0.5, zorder=0)
    axes.tick_params(length=0)
    axes.legend(fontsize=7.5, ncols=2)
