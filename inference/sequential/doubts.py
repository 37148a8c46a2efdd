"""What makes the numbers of a fit doubtful, found out with a few more rollouts."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...core.arrays import FloatArray
from ...core.differences import fourth_differences, robust_sd
from ...core.errors import InputError
from ...core.parameters import ParameterSpace
from ...core.rollout import Trajectory
from ...core.scenarios.measured import MEASURED_PIECE
from ...core.scenarios.spacing import MATTERS, off_places
from ...core.scenarios.standoffs import standing_off
from ...core.series import PointSeries
from ...core.study import Problem, SimulationPool, Task
from ..noise import Noise
from ..residuals import rms_apart
from ..roughness import Roughness, roughness, unrepeatable

#: A step that moves the model by more than this is told of [noise standard deviations].
STEP_MATTERS = 1.0
#: A rope that is turned in its grippers by more than this is told of [rad].
TURN_MATTERS = 0.2
#: Internal damping that is asked for where less lets a simulation be chaotic: that of cloth by default [s].
CALMING_TIME = 0.005


def doubts(pool: SimulationPool, space: ParameterSpace, unit: FloatArray, noise: Noise) -> list[str]:
    """Sentences for people; empty if nothing is doubtful.

    What a rollout does by chance tells nothing of the parameters. A motion that is rough at the frame rate passes for
    noise where the noise is estimated from roughness. What the time step does passes for the material's doing. Markers
    beside the axis of a rope let it seem longer or shorter than it is, as it is bent, and those that sit elsewhere on a
    cloth than they are said to pass for what it does.
    """
    problem = pool.problem
    values = space.as_dict(space.from_unit(unit))
    plain: dict[str, Trajectory] = {}
    for name, outcome in zip(problem.fit_on, pool.map([Task(values, n) for n in problem.fit_on]), strict=True):
        if not isinstance(outcome, Trajectory):
            return [f"the best fit cannot be simulated: {outcome.reason}"]
        plain[name] = outcome
    out: list[str] = []
    rough = roughness(pool, space, unit, problem.fit_on)
    if failing := [n for n in problem.fit_on if n not in rough.sd]:
        out.append(f"close to the best fit {', '.join(failing)} cannot be simulated, so ± means little")
    if loose := unrepeatable(rough, problem.recordings, noise):
        out.append(_left_to_chance(problem, values, loose))
    out += step_matters(pool, values, plain, rough, noise)
    out += [*markers_beside(problem), *rope_turned(problem), *markers_elsewhere(problem, plain)]
    if noise.source.startswith("roughness"):
        own = robust_sd(fourth_differences(plain[problem.fit_on[0]].series.points))
        if own > 0.5 * noise.sd:
            out.append(
                "the motion is fast for the frame rate and passes for noise, which is overestimated; "
                f"give it: [noise] sd = ... in {'metres' if noise.unit == 'm' else 'pixels'}, or record repeats"
            )
    return out


def _left_to_chance(problem: Problem, values: Mapping[str, float], where: list[str]) -> str:
    """The sentence of it, with what would help by what there is."""
    moved = f"next to nothing in the parameters moves {'; '.join(where)}; what it does there"
    if problem.extractor.needs_images:
        return (
            f"what [extractor] finds in drawn pictures jumps: {moved} is chance and does not count. More points, or an "
            "extractor that finds the same ones again, would tell more"
        )
    now, piece = problem.material.damping_time, _piece(problem)
    if "damping_time" in values:
        more = "raise the lower bound [parameters.damping_time] low"
    elif now < CALMING_TIME:
        more = f"set [material] damping_time = {CALMING_TIME:g}"
    else:
        more = f"set [material] damping_time higher than the {now:g} that it is"
    return (
        f"the simulation is chaotic: {moved} is chance and does not count. Where chance does not decide in reality, "
        f"{more} or lower [simulator] time_step"
        + (f"; fitted in pieces, it does not come so far: [study] window = {piece:.3g}" if piece else "")
    )


def _piece(problem: Problem) -> float | None:
    """Length of pieces [s] that takes could be fitted in, as each would start as measured; None if they could not.

    Shorter takes are halved.
    """
    scenarios = [problem.scenarios[name] for name in problem.fit_on]
    if problem.pieces > 1.0 or any(s.start_motion is None for s in scenarios):
        return None
    return min(MEASURED_PIECE, *(float(np.ptp(s.times)) / 2 for s in scenarios))


def step_matters(
    pool: SimulationPool, values: dict[str, float], plain: Mapping[str, Trajectory], rough: Roughness, noise: Noise
) -> list[str]:
    """What half the time step changes, in a sentence, where that is more than the noise.

    Frames that chance decides are left out: there a smaller step would be another throw of the dice.

    Args:
        pool, values: of the model with its own step, and where it fits best.
        plain: what it predicts there, by recording.
        rough: what it cannot repeat there.
        noise: of the measurement.
    """
    finer = pool.problem.simulator.finer()
    if finer is None:
        return []
    with SimulationPool(replace(pool.problem, simulator=finer), min(1, pool.workers)) as other:
        outcomes = dict(zip(plain, other.map([Task(values, name) for name in plain]), strict=True))
        pool.count += other.count
    pairs = []
    for name, outcome in outcomes.items():
        if isinstance(outcome, Trajectory) and name in rough.sd:
            counts = rough.sd[name] <= noise.sd
            pairs.append((outcome.series.points[counts], plain[name].series.points[counts]))
    changed = rms_apart(pairs)
    if changed <= STEP_MATTERS * noise.sd:
        return []
    size = f"{1e3 * changed:.2g} mm" if noise.unit == "m" else f"{changed:.2g} px"
    return [
        f"half the time step moves the model by {size}, {changed / noise.sd:.2g} times the noise: what the step does "
        "passes for the material's doing or for a misfit; lower [simulator] time_step until that no longer counts"
    ]


def markers_beside(problem: Problem) -> list[str]:
    """That markers stand beside the axis, in a sentence, where a rope that starts as measured has them on it."""
    scenarios = [problem.scenarios[name] for name in problem.fit_on]
    if any(s.start_motion is None or s.beside is not None for s in scenarios):
        return []
    away = standing_off([problem.recordings[name] for name in problem.fit_on])
    if not away:
        return []
    return [
        f"the distances between markers change as the rope bends as if these stood {1e3 * away:.2g} mm beside its "
        'axis; [scenario] markers = "beside" takes them to be there'
    ]


def rope_turned(problem: Problem) -> list[str]:
    """That a rope is turned in its grippers, in a sentence, by more than their poses say."""
    turned = []
    for name in problem.fit_on:
        scenario, said = problem.scenarios[name], problem.recordings[name].gripper
        if scenario.beside is None or said is None:
            return []
        start = scenario.times[:1]
        apart = np.sum(scenario.motion.at(start)[0, :, 3:] * said.at(start)[0, :, 3:], axis=1)
        turned.append(2.0 * np.arccos(np.minimum(np.abs(apart), 1.0)))
    first, last = np.sqrt(np.mean(np.square(turned), axis=0))
    if max(first, last) <= TURN_MATTERS:
        return []
    return [
        f"the distances between markers show the rope turned about itself in its grippers, by {first:.2g} rad in the "
        f"first and {last:.2g} rad in the second (root mean square over the recordings), beyond what their poses say; "
        "simulations start so, told in held-out recordings by how these start alone: record poses that say how the "
        "grippers turn the rope, or mount it the same way each time"
    ]


def markers_elsewhere(problem: Problem, plain: Mapping[str, Trajectory]) -> list[str]:
    """That markers sit elsewhere on a flat cloth than the study says, in a sentence, by how far apart they are seen.

    As far apart as in the model, whose cloth is bent and folded much the same, they are where they are said to be.

    Args:
        problem: of the study.
        plain: what the model predicts where it fits best, by recording.
    """
    scenario = problem.scenarios[problem.fit_on[0]]
    if not np.isin(scenario.markers, (0.0, 1.0)).all():  # tied to where they are seen, or placed by their distances
        return []
    measured = [problem.recordings[name] for name in problem.fit_on]
    try:
        seen = off_places(scenario, measured)
        made = [replace(r, series=_seen_alike(plain[r.name].series, r.series)) for r in measured]
        away = np.linalg.norm(seen - off_places(scenario, made), axis=1)
    except InputError:  # not a flat cloth, or nothing followed
        return []
    rms, worst = float(np.sqrt(np.mean(away**2))), int(np.argmax(away))
    if rms <= MATTERS:
        return []
    return [
        f"neighbouring markers are seen as far apart as if they sat {1e3 * rms:.2g} mm from where [scenario] markers "
        f'puts them, marker {worst} {1e3 * away[worst]:.2g} mm; [scenario] spacing = "measured" places them by '
        "these distances"
    ]


def _seen_alike(made: PointSeries, measured: PointSeries) -> PointSeries:
    """What is simulated, in the frames in which it is measured."""
    return replace(made, points=np.where(measured.valid[..., None], made.points, np.nan))
