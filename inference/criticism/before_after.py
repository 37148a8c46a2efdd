"""What the model without and with what was named does on every recording, for the report."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.arrays import FloatArray
from ...core.parameters import ParameterSpace
from ...core.rollout import Trajectory
from ...core.study import Task
from ..residuals import Residual, residual
from .comparing.held import as_recorded
from .work import Work


@dataclass(frozen=True, eq=False)
class Take:
    """One recording and its two predictions."""

    name: str
    trajectories: tuple[Trajectory, Trajectory]
    residuals: tuple[Residual, Residual]


class BeforeAfter:
    """The predictions at two fits.

    Args:
        work: where they are simulated.
        fits: space and point of the unit cube, before and after.
    """

    def __init__(self, work: Work, *fits: tuple[ParameterSpace, FloatArray]) -> None:
        problem = work.problem
        names = [*problem.fit_on, *problem.hold_out]
        outcomes = iter(work.pool.map([Task(s.as_dict(s.from_unit(u)), n) for n in names for s, u in fits]))
        self.takes: dict[str, Take] = {}
        self._problem = problem
        for name in names:
            pair = next(outcomes), next(outcomes)
            first, second = pair
            if isinstance(first, Trajectory) and isinstance(second, Trajectory):
                recording = problem.recordings[name]
                each = [residual(recording, o.series, work.fit.noise, work.offsets) for o in (first, second)]
                self.takes[name] = Take(name, (first, second), (each[0], each[1]))

    def error(self, names: tuple[str, ...]) -> tuple[float, float]:
        """Root mean square over recordings ``names`` [unit], before and after; NaN where none could be simulated."""
        there = [self.takes[n].residuals for n in names if n in self.takes]
        if not there:
            return float("nan"), float("nan")
        before, after = (float(np.sqrt(np.mean(np.concatenate([_squares(pair[k]) for pair in there])))) for k in (0, 1))
        return before, after

    def arrays(self) -> dict[str, dict[str, tuple[Any, list[str], str]]]:
        """Errors over time and shapes, a group a recording: array, dimensions, unit."""
        out: dict[str, dict[str, tuple[Any, list[str], str]]] = {}
        for name, take in self.takes.items():
            series = self._problem.recordings[name].series
            out[name] = {"time": (series.time, ["time"], "s")}
            for when, trajectory, r in zip(("before", "after"), take.trajectories, take.residuals, strict=True):
                shown = as_recorded(trajectory, r)
                out[name] |= {
                    f"error_{when}": (r.by_time, ["time"], series.unit),
                    f"predicted_{when}": (shown.series.points, ["time", "predicted_point", "axis"], series.unit),
                    f"vertices_{when}": (shown.vertices, ["time", "vertex", "axis"], "m"),
                }
        return out


def _squares(r: Residual) -> FloatArray:
    return np.asarray(r.difference[np.isfinite(r.difference)] ** 2)
