"""The step ``compare``: hold the fitted model against every recording; where and when does it fail?"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import MuslinError
from ...core.measurement import Recording
from ...core.rollout import Trajectory
from ...core.scenario import Scenario
from ...core.series import PointSeries
from ...core.store import read, storage_errors
from ...core.study import Outcome, Study, Task
from ..discrepancy import Discrepancy
from ..noise import Noise
from ..polish import Objective
from ..residuals import residual, rms
from ..sequential.polishing import offsets_of
from ..sequential.result import load_fit
from .comparing.adequacy import adequacy
from .comparing.excess import excess, sentence
from .comparing.groups import motion_of, partitions
from .comparing.held import Held, as_recorded
from .comparing.joining import rejoined
from .comparing.result import Comparison, Row, pieces_sentence, sets_sentence
from .comparing.sets import SetView, set_view
from .comparing.writing import write_take

#: Posterior draws that are simulated for the scatter of predictions.
PREDICTIVE = 8


def compare(study: Study) -> Comparison:
    """Simulate every recording with the best fit, with posterior draws and with the unfitted model."""
    fit, problem = load_fit(study), study.problem
    study.check_writable()
    fit = replace(fit, noise=fit.noise.normal)
    names = [*problem.fit_on, *problem.hold_out]
    rng = np.random.default_rng([study.config.study.seed, 31])
    draws = fit.samples[rng.choice(len(fit.samples), PREDICTIVE, replace=False)]
    middle = problem.space.as_dict(problem.space.from_unit(np.full(len(problem.space), 0.5)))
    values = [fit.values(), middle, *(problem.space.as_dict(d) for d in draws)]
    offsets, unit = offsets_of(study), read(study.step_results("fit"), "estimate_unit")
    with study.pool(problem) as pool:
        tasks = [Task(v, name) for name in names for v in values]
        outcomes = []
        for k, outcome in enumerate(pool.map(tasks)):
            outcomes.append(outcome)
            study.progress("comparing", k + 1, len(tasks))
        takes = [
            _held(study, name, outcomes[k * len(values) : (k + 1) * len(values)], fit.noise)
            for k, name in enumerate(names)
        ]
        study.progress("finding what a refit could explain", 0, 0)
        discrepancy = Discrepancy(step=fit.derivative_step)
        objective = Objective(pool, problem.space, problem.fit_on, fit.noise, offsets, discrepancy=discrepancy)
        jacobian = objective.jacobian(unit)
    study.progress("comparing with what noise gives", 0, 0)
    fitted = takes[: len(problem.fit_on)]
    tested = adequacy(fitted, partitions(fitted), jacobian, unit, fit.noise, offsets, rng)
    takes = rejoined(takes, problem.cut_from)
    sorted_by = partitions(takes)
    groups = excess(takes, sorted_by, fit.noise, rng)
    sets = [set_view(h, fit.noise, rng) for h in takes]
    rows = tuple(_row(h, fit.noise, s) for h, s in zip(takes, sets, strict=True))
    loose = tuple(r for r, h in zip(rows, takes, strict=True) if not h.paired)
    alike = sets_sentence(loose) if loose else ""
    result = Comparison(
        rows, tested, tuple(groups), sentence(groups, len(takes)), alike, pieces_sentence(problem.pieces)
    )
    with storage_errors(study.results_path):
        group = study.results("r+").create_group("compare", overwrite=True)
        for held, view, motion in zip(takes, sets, motion_of(takes), strict=True):
            write_take(group.create_group(held.name), held, view, motion)
        group.attrs.update({**result.to_json(), "text": result.text(), "fingerprint": study.fingerprint("compare")})
        group.attrs["finished"] = True
    return result


def _held(study: Study, name: str, outcomes: Sequence[Outcome], noise: Noise) -> Held:
    """``outcomes``: of the best fit, of the unfitted model, and of the posterior draws."""
    recording, scenario = study.problem.recordings[name], study.problem.scenarios[name]
    best, plain, *draws = outcomes
    offsets = offsets_of(study)
    if not isinstance(best, Trajectory):
        raise MuslinError(f"the best fit cannot be simulated on recording {name!r}: {best.reason}")
    time, off = recording.series.time, residual(recording, best.series, noise, offsets)
    predicted = [
        residual(recording, o.series, noise, offsets).recorded(time, o.series.points)
        for o in draws
        if isinstance(o, Trajectory)
    ]
    nowhere = np.full(recording.series.points.shape, np.nan)
    return Held(
        recording,
        scenario,
        name in study.problem.fit_on,
        best,
        as_recorded(best, off),
        off,
        np.stack(predicted) if predicted else np.zeros((0, *best.series.points.shape)),
        study.problem.extractor.uses_markers,
        residual(recording, carried(recording, scenario), noise, offsets).difference,
        residual(recording, plain.series, noise, offsets).difference if isinstance(plain, Trajectory) else nowhere,
    )


def _row(held: Held, noise: Noise, sets: SetView) -> Row:
    time = held.recording.series.time
    scatter = np.std(held.draws, axis=0) if len(held.draws) > 1 else np.zeros(1)
    return Row(
        recording=held.name,
        role="fit" if held.fitted else "held-out",
        rmse=held.residual.rms,
        noise=noise.sd,
        scatter=float(np.sqrt(np.mean(scatter**2))),
        baseline=rms(held.baseline),
        default=rms(held.unfitted),
        worst_time=float(time[int(np.nanargmax(held.residual.by_time))]),
        worst_point=int(np.nanargmax(held.residual.by_point)),
        unit=held.recording.series.unit,
        clock_offset=held.residual.clock,
        sets_beyond=sets.beyond,
        sets_p_value=sets.p_value,
        sets_worst_time=float(time[sets.worst]),
    )


def carried(recording: Recording, scenario: Scenario) -> PointSeries:
    """The trivial baseline: the first measured shape, carried along by the first gripper."""
    points = recording.series.points
    ever = np.isfinite(points).any(axis=0)
    first = np.where(np.isfinite(points[0]), points[0], np.nanmedian(np.where(ever, points, 0.0), axis=0))
    if not scenario.grasps or scenario.motion.grippers == 0:
        moved: FloatArray = np.repeat(first[None], len(points), axis=0)
    else:
        gripper: FloatArray = scenario.motion.at(recording.series.time)[:, 0, :3]
        if recording.camera is not None and recording.series.unit == "px":
            gripper = recording.camera.project(gripper)[0]
        moved = first[None] + (gripper - gripper[0])[:, None]
    return replace(recording.series, points=moved)
