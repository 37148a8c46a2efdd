"""One wide picture of a whole study, for a README."""

from textwrap import fill
from typing import Any

from ...core.errors import StepMissingError
from ...core.study.study import Study
from .figures_error import draw_error, error_ceiling
from .figures_object import add_snapshots, snapshots
from .gather import gather
from .style import AFTER, BEFORE, INK, look, new_figure, png
from .verdict import verdict

#: Letters of a line of the headline, as many as are sure to fit.
_WIDEST = 120


def draw_overview(study: Study, after: Study | None = None) -> bytes:
    """PNG: error over time on a held-out recording, and the object at the worst moment.

    Raises:
        StepMissingError: the study has not been compared.
    """
    found = gather(study, after)
    if not found.takes:
        raise StepMissingError(f"{study.path} has no result of 'compare' yet; run: muslin compare {study.path}")
    take, name = found.takes[0], found.after_label
    with look("overview"):
        figure = new_figure(13.0, 4.6)
        figure.suptitle(fill(verdict(found).headline, _WIDEST), x=0.012, ha="left", fontsize=13, color=INK)
        left, right = list(figure.subfigures(1, 2, width_ratios=[1.0, 1.25], squeeze=False)[0])
        axes = left.add_subplot()
        draw_error(axes, take, error_ceiling([take]))
        held = ", held out" if take.held_out else ""
        axes.set_title(f"recording {take.name}{held}", loc="left", color=INK, fontsize=10, pad=19)
        key = [("fitted model", BEFORE), (f"with {name}", AFTER)][: 2 if take.after is not None else 1]
        style: dict[str, Any] = {"fontsize": 9, "va": "bottom", "textcoords": "offset points"}
        beside: Any = axes.transAxes  # the first stands on the axes, every other to the right of the one before
        at, gap = (0.0, 1.0), (0.0, 4.0)
        shades = [("grey: noise", "#8b8d8a"), ("pale: posterior", "#b98a6b")][: 2 if take.scatter is not None else 1]
        for label, colour in [*key, *shades]:
            beside = axes.annotate(label, at, gap, xycoords=beside, color=colour, **style)
            beside.set_in_layout(False)  # or a long row makes the axes narrow
            at, gap = (1.0, 0.0), (12.0, 0.0)
        shots = snapshots(take, name)
        if shots:
            spots = list(right.subplots(1, len(shots), squeeze=False)[0])
            add_snapshots(right, spots, shots, take)
        return png(figure, 140)
