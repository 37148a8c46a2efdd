"""The step ``compare``: hold the fitted model against every recording; where and when does it fail?"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import zarr

from ...core.arrays import FloatArray
from ...core.errors import MuslinError
from ...core.measurement import Recording
from ...core.rollout import Trajectory
from ...core.scenario import Scenario
from ...core.series import PointSeries
from ...core.store import put, storage_errors
from ...core.study import Outcome, Study, Task
from ..noise import Noise
from ..residuals import Residual, residual
from ..sequential.fitting import offsets_of
from ..sequential.result import load_fit

#: Posterior draws that are simulated for the scatter of predictions.
PREDICTIVE = 8
#: A model is called adequate unless a misfit this large is less probable than that under the noise.
SIGNIFICANCE = 0.01


@dataclass(frozen=True)
class Row:
    """One recording. Errors are root mean squares over coordinates [unit].

    Args:
        recording, role: its name, and ``"fit"`` or ``"held-out"``.
        rmse: of the best fit.
        noise: of the measurement.
        scatter: of predictions over posterior draws.
        baseline: of the first measured shape, carried along by the gripper.
        default: of the unfitted model, the middle of the prior.
        worst_time: when the best fit is farthest off [s].
        worst_point: which point is farthest off over all times.
        unit: of the errors.
    """

    recording: str
    role: str
    rmse: float
    noise: float
    scatter: float
    baseline: float
    default: float
    worst_time: float
    worst_point: int
    unit: str


@dataclass(frozen=True)
class Comparison:
    """What :func:`compare` found.

    Args:
        rows: a row a recording.
        p_value: probability of a misfit at least this large on the fitted recordings if the model and
            the noise were right.
        adequate: the p value is above :data:`SIGNIFICANCE`.
    """

    rows: tuple[Row, ...]
    p_value: float
    adequate: bool

    def text(self) -> str:
        """A table and a sentence for people."""
        unit, factor = ("mm", 1e3) if self.rows[0].unit == "m" else (self.rows[0].unit, 1.0)
        head = f"{'recording':<20} {'role':<9} {'error':>8} {'noise':>8} {'scatter':>8} {'baseline':>9} {'unfitted':>9}"
        lines = [f"{head}  worst at   [{unit}, root mean square a coordinate]"]
        for r in self.rows:
            cells = "".join(
                f" {factor * v:>{w}.2f}"
                for v, w in ((r.rmse, 8), (r.noise, 8), (r.scatter, 8), (r.baseline, 9), (r.default, 9))
            )
            lines.append(f"{r.recording:<20} {r.role:<9}{cells}  {r.worst_time:.2f} s, point {r.worst_point}")
        says = "is adequate: the misfit is no larger than the noise explains" if self.adequate else "is not adequate"
        lines.append(f"The model {says} (p = {self.p_value:.2g}).")
        return "\n".join(lines)


def compare(study: Study) -> Comparison:
    """Simulate every recording with the best fit, with posterior draws and with the unfitted model."""
    fit, problem = load_fit(study), study.problem
    names = [*problem.fit_on, *problem.hold_out]
    rng = np.random.default_rng([study.config.study.seed, 31])
    draws = fit.samples[rng.choice(len(fit.samples), PREDICTIVE, replace=False)]
    middle = problem.space.as_dict(problem.space.from_unit(np.full(len(problem.space), 0.5)))
    values = [fit.values(), middle, *(problem.space.as_dict(d) for d in draws)]
    with study.pool(problem) as pool:
        tasks = [Task(v, name) for name in names for v in values]
        outcomes = []
        for k, outcome in enumerate(pool.map(tasks)):
            outcomes.append(outcome)
            study.progress("comparing", k + 1, len(tasks))
    takes = [
        _hold_against(study, name, outcomes[k * len(values) : (k + 1) * len(values)], fit.noise)
        for k, name in enumerate(names)
    ]
    white = np.concatenate([t.residual.white for t in takes if t.row.role == "fit"])
    p = misfit_p_value(white, len(problem.space), fit.noise, rng)
    result = Comparison(tuple(t.row for t in takes), p, p > SIGNIFICANCE)
    with storage_errors(study.results_path):
        group = study.results("r+").create_group("compare", overwrite=True)
        for name, take in zip(names, takes, strict=True):
            _write(group.create_group(name), problem.recordings[name], problem.scenarios[name], take)
        group.attrs.update(
            {
                "p_value": p,
                "adequate": result.adequate,
                "text": result.text(),
                "rows": [vars(row) for row in result.rows],
                "fingerprint": study.fingerprint("compare"),
            }
        )
        group.attrs["finished"] = True
    return result


@dataclass(frozen=True, eq=False)
class _Take:
    """One recording held against its predictions."""

    row: Row
    best: Trajectory
    residual: Residual
    scatter: FloatArray


def _hold_against(study: Study, name: str, outcomes: Sequence[Outcome], noise: Noise) -> _Take:
    """``outcomes``: of the best fit, of the unfitted model, and of the posterior draws."""
    recording, scenario, offsets = study.problem.recordings[name], study.problem.scenarios[name], offsets_of(study)
    best, unfitted, *draws = outcomes
    if not isinstance(best, Trajectory):
        raise MuslinError(f"the best fit cannot be simulated on recording {name!r}: {best.reason}")
    r = residual(recording, best.series, noise, offsets)
    predicted = [o.series.points for o in draws if isinstance(o, Trajectory)]
    scatter = np.std(predicted, axis=0) if len(predicted) > 1 else np.zeros_like(best.series.points)
    plain = residual(recording, unfitted.series, noise, offsets).rms if isinstance(unfitted, Trajectory) else np.nan
    row = Row(
        recording=name,
        role="fit" if name in study.problem.fit_on else "held-out",
        rmse=r.rms,
        noise=noise.sd,
        scatter=float(np.sqrt(np.mean(scatter**2))),
        baseline=residual(recording, carried(recording, scenario), noise, offsets).rms,
        default=float(plain),
        worst_time=float(recording.series.time[int(np.nanargmax(r.by_time))]),
        worst_point=int(np.nanargmax(r.by_point)),
        unit=recording.series.unit,
    )
    return _Take(row, best, r, scatter)


def misfit_p_value(white: FloatArray, parameters: int, noise: Noise, rng: np.random.Generator) -> float:
    """Probability of a residual sum of squares at least this large, by simulation.

    Replicates are chi-square with the residual degrees of freedom, times the square of how far the
    true noise may be from its estimate.
    """
    degrees = max(noise.information * len(white) - parameters, 1.0)
    scale = 1.0 + noise.relative_error * rng.normal(size=20_000)
    replicate = rng.chisquare(degrees, size=20_000) * scale**2
    return float((1 + np.sum(replicate >= white @ white)) / 20_001)


def carried(recording: Recording, scenario: Scenario) -> PointSeries:
    """The trivial baseline: the first measured shape, carried along by the first gripper."""
    points = recording.series.points
    first = np.where(np.isfinite(points[0]), points[0], np.nanmedian(points, axis=0))
    if not scenario.grasps or scenario.motion.grippers == 0:
        moved = np.repeat(first[None], len(points), axis=0)
    else:
        poses = scenario.motion.at(recording.series.time)[:, 0]
        moved = first[None] + (poses[:, :3] - poses[0, :3])[:, None]
    return PointSeries(recording.series.time, moved, recording.series.unit, recording.series.correspondence)


def _write(group: zarr.Group, recording: Recording, scenario: Scenario, take: _Take) -> None:
    unit = recording.series.unit
    arrays: list[tuple[str, Any, list[str], str]] = [
        ("time", recording.series.time, ["time"], "s"),
        ("error", take.residual.by_time, ["time"], unit),
        ("scatter", np.sqrt(np.mean(take.scatter**2, axis=(1, 2))), ["time"], unit),
        ("point_error", take.residual.by_point, ["point"], unit),
        ("measured", recording.series.points, ["time", "point", "axis"], unit),
        ("predicted", take.best.series.points, ["time", "predicted_point", "axis"], unit),
        ("vertices", take.best.vertices, ["time", "vertex", "axis"], "m"),
        ("triangles", scenario.body.triangles, ["triangle", "corner"], "1"),
    ]
    for name, data, dims, its_unit in arrays:
        put(group, name, data, dims, its_unit)
    group.attrs["clock_offset_s"] = take.residual.clock
