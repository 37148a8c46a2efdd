"""Slices of a posterior, as the paper shows them: density in a plane, component means marked."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from ...core.arrays import FloatArray
from ...core.parameters import ParameterSpace
from .style import AFTER, BEFORE, INK, SOFT, look, new_figure, png
from .words import value, words

_MAP = LinearSegmentedColormap.from_list("slices", ["#ffffff", "#bfd9d6", AFTER, "#0a3b3a"])

#: Share of the mass of a slice that is as dark as can be.
_DARK = 0.05


class Cut(Protocol):
    """A slice, as the step ``slices`` gives it: see there."""

    parameters: tuple[int, int]
    through: FloatArray
    at: FloatArray
    log_prob: FloatArray
    weights: FloatArray
    centres: FloatArray


def slices_figure(space: ParameterSpace, cuts: Sequence[Cut]) -> bytes:
    """PNG of slices: density relative to the prior, from white to the darkest shade; axes are the prior's range.

    Args:
        space: of the parameters.
        cuts: one a panel. A cross marks the point through which all go, a dot the mean of a component of a mixture,
            the larger the more it weighs.
    """
    wide = min(3, len(cuts))
    tall = -(-len(cuts) // wide)
    with look("slices"):
        figure = new_figure(2.9 * wide, 2.7 * tall)
        panels = figure.subplots(tall, wide, squeeze=False).ravel()
        for axes in panels[len(cuts) :]:
            axes.set_visible(False)
        for axes, cut in zip(panels, cuts, strict=False):
            density = np.exp(cut.log_prob - _darkest(cut.log_prob))
            axes.imshow(density, origin="lower", extent=(0, 1, 0, 1), cmap=_MAP, vmin=0, vmax=1, aspect="auto")
            across, up = cut.parameters
            axes.plot(cut.through[across], cut.through[up], "+", color=INK, markersize=9, clip_on=False)
            axes.scatter(*cut.centres.T, s=8 + 60 * cut.weights, color=BEFORE, edgecolor="white", linewidth=0.6)
            axes.set(xlim=(0, 1), ylim=(0, 1))
            for k, side, label in ((across, axes.xaxis, axes.set_xlabel), (up, axes.yaxis, axes.set_ylabel)):
                parameter = list(space)[k]
                ends = space.from_unit(np.outer([0.0, 0.5, 1.0], np.ones(len(space))))[:, k]
                side.set_ticks([0, 0.5, 1], [value(float(v)) for v in ends])
                label(words(parameter.name) + ("" if parameter.unit == "1" else f" [{parameter.unit}]"))
            axes.tick_params(length=2, color=SOFT)
        return png(figure)


def _darkest(log_prob: FloatArray) -> float:
    """Where shades end: a sliver at a face may be far denser than all that counts, and would leave the rest pale."""
    falling = np.sort(log_prob.ravel())[::-1]
    mass = np.cumsum(np.exp(falling - falling[0]))
    return float(falling[np.searchsorted(mass, _DARK * mass[-1])])
