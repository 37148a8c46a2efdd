"""Every sign that the fitted recordings give of a misfit, beside what noise alone gives."""

from typing import Any

import numpy as np

from .findings import Table, number
from .style import AFTER, BEFORE, NOISE, RULE, SOFT, look, new_figure, svg

_MOST = 12


def adequacy_figure(compare: Table | None) -> str | None:
    """SVG of the largest signs; None if they are not known."""
    signs: list[dict[str, Any]] = list((compare or {}).get("signs") or [])[:_MOST]
    limit = number((compare or {}).get("limit"))
    if not signs or limit is None:
        return None
    z = np.array([number(s["z"]) or 0.0 for s in signs])
    y = np.arange(len(z))[::-1]
    with look("adequacy"):
        figure = new_figure(7.2, 0.55 + 0.23 * len(z))
        axes = figure.add_subplot()
        least = min(-2.0, float(z.min()) - 0.5)
        axes.axvspan(least, limit, color=NOISE, linewidth=0)
        axes.scatter(z, y, s=34, c=[BEFORE if v > limit else AFTER for v in z], zorder=3, clip_on=False)
        axes.set_xscale("symlog", linthresh=5.0)
        axes.set_xlim(least, max(1.3 * limit, 1.15 * float(z.max())))
        ticks = [t for t in (0, 2, 5, 10, 30, 100, 300, 1000, 3000) if t <= axes.get_xlim()[1]]
        axes.set_xticks(ticks, [str(t) for t in ticks])
        axes.minorticks_off()
        axes.set_yticks(y, [str(s["name"]) for s in signs], fontsize=8)
        axes.set_xlabel("above what noise gives, in its standard deviations", color=SOFT)
        axes.grid(axis="y", color=RULE, linewidth=0.5)
        axes.set_axisbelow(True)
        axes.tick_params(length=0)
        return svg(figure, "signs of a misfit beside what noise alone gives")
