"""How long a step may be for motion as fast as was recorded."""

import inspect
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.arrays import FloatArray, IntArray
from ..core.differences import rough_sd
from ..core.measurement import Recording
from ..core.registry import REGISTRY
from .study_plan import Plan

#: Speeds are those over so long [s]; neighbours are no nearer than this share of the size, which noise would turn, and
#: as many as these of each marker count.
_OVER, _NEAR, _NEIGHBOURS = 0.03, 0.15, 3
#: Of how fast parts turn this percentile counts; of noise so many standard deviations are at it, in space and in one
#: direction.
_MOST, _NOISE, _ALONG = 99.0, 3.4, 2.3
#: Of more markers so many tell it, and of more frames so many who is next to whom.
_MARKERS, _FRAMES = 300, 30
#: The usual step is halved so often at most.
_HALVINGS = 2


def paced(plan: Plan, recordings: Sequence[Recording]) -> tuple[Plan, list[str]]:
    """The plan with a shorter time step than usual, if its simulator asks for one in motion so fast; a remark."""
    simulator = REGISTRY.get("simulator", plan.simulator)
    option = inspect.signature(simulator).parameters.get("time_step")
    if simulator.most_turn is None or option is None:
        return plan, []
    usual = simulator.usual_steps.get(plan.kind, option.default)
    step, rate = halved(usual, simulator.most_turn, recordings)
    if step == usual:
        return plan, []
    return replace(plan, time_step=step), [
        f"it moves fast, parts of it turn by {rate:.0f} rad/s: steps of {1e3 * step:g} ms, as {plan.simulator} in its "
        f"usual ones of {1e3 * usual:g} ms would damp that ([simulator] time_step; fits take about {usual / step:g} "
        "times as long)"
    ]


def halved(usual: float, most_turn: float, recordings: Sequence[Recording]) -> tuple[float, float]:
    """The longest step [s] of ``usual``, its half and its quarter in which parts turn by ``most_turn`` [rad] at most.

    And how fast they turn [rad/s]. Where it is not known, as of points in pixels, the usual step.
    """
    rate = max((turning_rate(r) for r in recordings), default=0.0)
    halvings = np.clip(np.ceil(np.log2(max(rate * usual / most_turn, 1e-9))), 0, _HALVINGS)
    return float(usual / 2**halvings), rate


def turning_rate(recording: Recording) -> float:
    """How fast parts of an object turn [rad/s], by how neighbouring markers move past one another; 0 if not known."""
    series = recording.series
    time, points = series.time, series.points[:, :: -(-series.points.shape[1] // _MARKERS)]
    if not series.correspondence or series.unit != "m" or len(time) < 3:
        return 0.0
    over = max(1, round(_OVER / float(np.median(np.diff(time)))))
    pairs = _neighbours(points)
    if not len(pairs) or len(time) <= over:
        return 0.0
    span = time[over:] - time[:-over]
    velocity = (points[over:] - points[:-over]) / span[:, None, None]
    between = 0.5 * (points[over:] + points[:-over])
    i, j = pairs.T
    apart = np.linalg.norm(between[:, i] - between[:, j], axis=2)
    rates = np.linalg.norm(velocity[:, i] - velocity[:, j], axis=2)[apart > 0.0] / apart[apart > 0.0]
    rates = rates[np.isfinite(rates)]
    if not len(rates):
        return 0.0
    sd = 2.0 * rough_sd([points]) / (float(np.median(span)) * float(np.nanmedian(apart)))
    most = float(np.percentile(rates, _MOST))
    # of noise alone, and of noise along a motion that is faster than it
    return min(float(np.sqrt(max(0.0, most**2 - (_NOISE * sd) ** 2))), max(0.0, most - _ALONG * sd))


def _neighbours(points: FloatArray) -> IntArray:
    """Pairs of markers ``(N, 2)`` that are next to one another, by their usual distances."""
    frames = points[:: -(-len(points) // _FRAMES)]
    away = np.linalg.norm(frames[:, :, None] - frames[:, None], axis=3)
    seen = np.isfinite(away).any(axis=0)
    usual = np.where(seen, np.nanmedian(np.where(seen, away, 0.0), axis=0), np.inf)
    np.fill_diagonal(usual, np.inf)
    size = np.max(usual, where=np.isfinite(usual), initial=0.0)
    usual = np.where((usual < _NEAR * size) | (usual == 0.0), np.inf, usual)
    nearest = [(i, j) for i, row in enumerate(usual) for j in np.argsort(row)[:_NEIGHBOURS] if row[j] < np.inf]
    return np.array(nearest, np.int64).reshape(-1, 2)
