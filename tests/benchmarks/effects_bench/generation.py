"""From a case to what was measured and what it hides."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.effect import Effect
from muslin.core.errors import MuslinError, RolloutFailed
from muslin.core.material import with_fields
from muslin.core.measurement import Measurement, Recording
from muslin.core.powerless import why_powerless
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.series import PointSeries
from muslin.core.simulator import Simulator
from muslin.core.study import StudyConfig, parse_config
from muslin.core.study.objects import build_scenario
from muslin.core.study.problem import Problem, build_problem

from .cases import CORRELATION, DROPOUT, Case
from .outside import LAWS, effect_class
from .settings import SETTINGS, TIME_STEPS, frames
from .strength import RANGES, Calibrator, Scaled, direction, scaled, solve

#: A look-alike is one that leaves at most this, in units of -2 log likelihood, of a misfit of at least that.
TIED_AT_MOST, SHOWS_FROM = 3.0, 60.0
#: An effect does not show in poor data if it leaves at most this misfit after calibration [noise sd].
HIDDEN_AT_MOST = 0.15
#: How long a marker is lost, on average [frames].
LOST_FOR = 5.0


@dataclass(frozen=True)
class Truth:
    """What a case hides.

    Args:
        effects: names, of the library or not, that reality has.
        accepted: effects of the library any of which is a right name.
        rivals: effects that the data cannot tell from the truth.
        coefficients: of the effects.
        misfit: root mean square left after calibration, of each effect [what is left without any].
        left: root mean square that is left without any effect, noise and difference of engine or mesh [m].
        values: true parameters of the model.
    """

    effects: tuple[str, ...]
    accepted: tuple[str, ...]
    rivals: tuple[str, ...]
    coefficients: dict[str, dict[str, float]]
    misfit: dict[str, float]
    left: float
    values: dict[str, float]


@dataclass(frozen=True, eq=False)
class Generated:
    """A study of a case, its measurement, and the truth."""

    config: StudyConfig
    measurement: Measurement
    truth: Truth


def generate(case: Case) -> Generated:
    """Simulate what a case measures; the same case gives the same numbers.

    Raises:
        MuslinError: nothing that the case offers shows as it shall, or reality cannot be simulated.
    """
    config = study_config(case)
    blank = _blank(case)
    problem = build_problem(config, blank)
    rng = np.random.default_rng([case.seed, 63])
    drawn = problem.space.from_unit(rng.uniform(0.25, 0.75, len(problem.space)))
    values = problem.space.as_dict(drawn)
    truth = _hide(case, problem, blank, values, rng)
    effects = [effect_class(n)(**c) for n, c in truth.coefficients.items()]
    clean = _played(case, blank.recordings, problem, effects, values)
    noise = np.random.default_rng([case.seed, 64])
    noisy = [replace(s, points=s.points + flaws(s.points.shape, case, noise)) for s in clean]
    recordings = tuple(replace(r, series=s) for r, s in zip(blank.recordings, noisy, strict=True))
    return Generated(config, Measurement(recordings), truth)


def study_config(case: Case) -> StudyConfig:
    """The study file that goes with a case; it knows nothing of the truth."""
    setting = SETTINGS[case.setting]
    table = setting.table(markers=case.markers)
    fit_on, held_out = setting.roles[case.role]
    hold_out = [held_out, *([f"{held_out}-again"] if case.correlated else [])]
    content: dict[str, Any] = {
        "study": {"measurement": "recording.zarr", "fit_on": list(fit_on), "hold_out": hold_out, "seed": case.seed},
        "scenario": table.model_dump(exclude_defaults=True, exclude_none=True),
        "simulator": {"name": "mujoco", "time_step": TIME_STEPS[setting.thing]},
        "estimator": {"name": "bayessim-rkhs", "rounds": 2, "draws": 64},
        "parameters": {k: p.model_dump(exclude_none=True) for k, p in setting.parameters.items()},
    }
    return parse_config(content, f"case {case.seed}")


def _blank(case: Case) -> Measurement:
    """The recordings of a case with nothing in them yet.

    A second take of the held-out motion is what tells noise that is correlated in time.
    """
    setting = SETTINGS[case.setting]
    fit_on, held_out = setting.roles[case.role]
    again = [(held_out, f"{held_out}-again")] if case.correlated else []
    count = case.markers or len(setting.markers)
    out = []
    for motion_name, name in [(n, n) for n in (*fit_on, held_out)] + again:
        motion = setting.motions[motion_name]()
        times = frames(motion)
        series = PointSeries(times, np.zeros((len(times), count, 3)))
        out.append(Recording(name, series, motion, motion_name))
    return Measurement(tuple(out))


def _hide(
    case: Case, problem: Problem, blank: Measurement, values: dict[str, float], rng: np.random.Generator
) -> Truth:
    """Choose what is hidden: the first offer that shows as the case wants it.

    Another engine or mesh leaves a misfit of its own, and an effect that is small beside it is not there to be seen:
    strengths are set against both together.
    """
    if not case.offers:
        return Truth((), (), (), {}, {}, case.noise, values)
    left = case.noise
    if case.source != "same":
        fitted = [r for r in blank.recordings if r.name in problem.fit_on]
        other = _played(case, fitted, problem, [], values)
        recordings = {r.name: replace(r, series=s) for r, s in zip(fitted, other, strict=True)}
        gap = Calibrator(problem, values, case.noise).fit_to({**problem.recordings, **recordings}).misfit
        left = case.noise * float(np.hypot(1.0, gap))
    strengths = _Strengths(Calibrator(problem, values, left), case.strength, rng)
    for offer in case.offers:
        if any(_powerless(name, case, problem) for name in offer):
            continue
        found = _try(case, offer, strengths)
        if found is not None:
            hidden, rivals = found
            accepted = () if case.kind == "unknown" else tuple(hidden)
            if case.kind == "law":
                accepted = LAWS[offer[0]][1]
            return Truth(
                tuple(hidden),
                accepted,
                rivals,
                {n: s.coefficients for n, s in hidden.items()},
                {n: s.misfit for n, s in hidden.items()},
                left,
                values,
            )
    raise MuslinError(f"case {case.seed}: nothing that it offers shows as it shall")


def _powerless(name: str, case: Case, problem: Problem) -> bool:
    scenario = problem.scenarios[problem.fit_on[0]]
    return any(
        why_powerless(effect_class(name), simulator, scenario) is not None
        for simulator in (problem.simulator, _reality(case))
    )


@dataclass(eq=False)
class _Strengths:
    """Effects at the strength of a case, each tried once however many offers it is part of."""

    calibrator: Calibrator
    strength: str
    rng: np.random.Generator
    tried: dict[str, Scaled | None] = field(default_factory=dict)

    def of(self, name: str) -> Scaled | None:
        if name not in self.tried:
            effect = effect_class(name)
            self.tried[name] = scaled(self.calibrator, effect, direction(effect, self.rng), self.strength)
        return self.tried[name]


def _try(case: Case, offer: tuple[str, ...], strengths: _Strengths) -> tuple[dict[str, Scaled], tuple[str, ...]] | None:
    if case.kind == "tied":
        return _look_alike(offer[0], offer[1], strengths.calibrator, strengths.rng)
    if case.kind == "poor":
        return _unseen(offer[0], strengths.calibrator, strengths.rng)
    hidden = {}
    for name in offer:
        found = strengths.of(name)
        if found is None:
            return None
        hidden[name] = found
    return hidden, ()


def _unseen(name: str, calibrator: Calibrator, rng: np.random.Generator) -> tuple[dict[str, Scaled], tuple[()]] | None:
    """A typical strength, where it does not show."""
    effect = effect_class(name)
    coefficients = {k: 0.4 * v for k, v in direction(effect, rng).items()}
    try:
        misfit = calibrator.fit([effect(**coefficients)]).misfit
    except RolloutFailed:
        return None
    return ({name: Scaled(coefficients, misfit)}, ()) if misfit <= HIDDEN_AT_MOST else None


def _look_alike(
    name: str, rival: str, calibrator: Calibrator, rng: np.random.Generator
) -> tuple[dict[str, Scaled], tuple[str, ...]] | None:
    """A strength that shows, at which the rival explains what shows as well as the truth does."""
    effect, largest = effect_class(name), direction(effect_class(name), rng)
    calibrator.problem = replace(
        calibrator.problem, effects={**calibrator.problem.effects, rival: REGISTRY.get("effect", rival)}
    )

    def made(share: float) -> Effect:
        return effect(**{k: share * v for k, v in largest.items()})

    share, misfit = solve(lambda s: calibrator.fit([made(s)]).misfit, 1.5, RANGES["weak"])
    for _ in range(2):
        if share <= 0:
            return None
        gap = calibrator.fit([made(share)], among=(rival,)).fit.rss
        if gap <= TIED_AT_MOST:
            break
        share *= float(np.sqrt(0.5 * TIED_AT_MOST / gap))  # both grow with the square of the strength
        misfit = calibrator.fit([made(share)]).misfit
    else:
        gap = calibrator.fit([made(share)], among=(rival,)).fit.rss
    numbers = 3 * sum(calibrator.problem.recordings[n].series.points[..., 0].size for n in calibrator.problem.fit_on)
    if gap > TIED_AT_MOST or misfit**2 * numbers < SHOWS_FROM:
        return None
    return {name: Scaled({k: share * v for k, v in largest.items()}, misfit)}, (rival,)


def _reality(case: Case) -> Simulator:
    step = TIME_STEPS[SETTINGS[case.setting].thing]
    if case.source == "other":
        made: Simulator = REGISTRY.get("simulator", "pybullet")()
        return made
    made = REGISTRY.get("simulator", "mujoco")(time_step=step / 2 if case.source == "finer" else step)
    return made


def _played(
    case: Case, recordings: Sequence[Recording], problem: Problem, effects: list[Effect], values: dict[str, float]
) -> list[PointSeries]:
    """What really happened in each recording, without noise."""
    table = SETTINGS[case.setting].table(fine=case.source == "finer", markers=case.markers)
    simulator, material = _reality(case), with_fields(problem.material, values)
    made: dict[str, PointSeries] = {}
    for recording in recordings:
        if recording.motion not in made:
            scenario = build_scenario(table, recording, Path())
            made[recording.motion] = rollout(simulator, scenario, material, effects, time_limit=300.0).series
    return [made[r.motion] for r in recordings]


def flaws(shape: tuple[int, ...], case: Case, rng: np.random.Generator) -> FloatArray:
    """Noise ``(T, P, 3)`` [m], NaN where a marker is lost.

    A lost marker stays lost for :data:`LOST_FOR` frames on average, and :data:`DROPOUT` of all are lost.
    """
    wild = rng.normal(size=shape)
    if case.correlated:
        for t in range(1, len(wild)):
            wild[t] = CORRELATION * wild[t - 1] + np.sqrt(1 - CORRELATION**2) * wild[t]
    wild *= case.noise
    if case.dropouts:
        lost = rng.random(shape[1]) < DROPOUT
        for t in range(len(wild)):
            u = rng.random(shape[1])
            lost = np.where(lost, u < 1 - 1 / LOST_FOR, u < DROPOUT / (1 - DROPOUT) / LOST_FOR)
            wild[t, lost] = np.nan
    return np.asarray(wild)
