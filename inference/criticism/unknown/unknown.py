"""The step ``unknown``: which force does the model lack, and what simple law does it follow?"""

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ....core.arrays import FloatArray
from ....core.effect import Effect
from ....core.errors import MuslinError
from ....core.measurement import check_spatial
from ....core.registry import REGISTRY
from ....core.store import put, read, storage_errors
from ....core.study import Problem, SimulationPool, Study
from ...discrepancy import Discrepancy
from ...polish import Objective
from ...residuals import Offsets
from ...roughness import check_repeatable, roughness
from ...sequential.polishing import offsets_of
from ...sequential.result import FitResult, load_fit
from ..misfit import NEGLIGIBLE
from ..told import Told
from .basis import make_basis
from .decision import Case, LawDecision, decide
from .estimate import Estimate, ForceObjective, Unknowns
from .field import Aim, field_effect
from .follow import follow, make_aim
from .library import pieces_of, responses
from .picture import force_arrays, worst_frame
from .refit import LAW, Refits, RefittedLaw, distinct
from .result import law_result, law_text
from .search import KEPT, best_laws
from .solve import estimate_force

#: Functions that the force is made of, over all recordings; each is a rollout for every set of sensitivities.
FUNCTIONS, MOST_FUNCTIONS = 180, 90
#: Recordings on which the force is estimated, those of largest misfit; the law is fitted to all of them.
MOST_RECORDINGS = 3


class Finding(Told):
    """What :func:`unknown` found: JSON, which ``muslin add --law`` reads too, and a text for people."""


def unknown(study: Study) -> Finding:
    """Estimate the missing force on the fitted recordings, and the law it follows; save both in the study's store."""
    began, fit, problem = time.monotonic(), load_fit(study), study.problem
    study.check_writable()
    fit = replace(fit, noise=fit.noise.normal)
    for name in problem.fit_on:  # a force in space is not told by pictures of one camera
        check_spatial(problem.recordings[name])
    offsets, unit = offsets_of(study), read(study.step_results("fit"), "estimate_unit")
    study.progress("asking what is chance", 0, 0)
    with study.pool(problem) as pool:
        rough = roughness(pool, problem.space, unit, problem.fit_on)
        discrepancy = rough.discrepancy(problem.recordings, fit.noise, offsets)
        plain = _plain(pool, problem, fit, offsets, discrepancy, unit)
        held_out = Refits(pool, problem, fit.noise, offsets, discrepancy, {}).held_out(problem.space, unit)
        count = pool.count
    check_repeatable(discrepancy, problem.fit_on)
    numbers = sum(len(w) for w in plain.values()) - discrepancy.dropped(problem.fit_on)
    case = Case(
        rss_plain=sum(float(w @ w) for w in plain.values()),
        count=max(fit.noise.information * numbers - len(unit), 1.0),
        held_out_plain=held_out,
        noise_sd=fit.noise.sd,
        noise_error=fit.noise.relative_error,
        unsure=fit.noise.information * discrepancy.left_to_chance(problem.fit_on),
    )
    estimate: Estimate | None = None
    decision: LawDecision | None = None
    if case.has_misfit:
        names = sorted(plain, key=lambda n: -float(plain[n] @ plain[n]) / len(plain[n]))[:MOST_RECORDINGS]
        names = [n for n in problem.fit_on if n in names]
        unknowns, full, aims = _unknowns(problem, names)
        with study.pool(full) as pool:
            objective, starts = _objective(study, pool, unknowns, aims, fit, offsets, discrepancy)
            study.progress("estimating the missing force", 0, 0)
            estimate = estimate_force(objective, starts, unit)
            case, decision = _law(study, objective, problem, estimate, case)
            count += pool.count
    result = law_result(case, estimate, decision, problem, fit.noise)
    result |= {"simulations": count, "seconds": time.monotonic() - began, "seed": study.config.study.seed}
    paragraphs = law_text(result)
    with storage_errors(study.results_path):
        group = study.results("r+").create_group("unknown", overwrite=True)
        for name, arrays in (force_arrays(estimate, problem) if estimate else {}).items():
            sub = group.create_group(name)
            for key, (data, dims, unit_name) in arrays.items():
                put(sub, key, data, dims, unit_name)
            sub.attrs["worst_frame"] = worst_frame(arrays["force"][0])
        group.attrs.update({"result": result, "text": list(paragraphs), "fingerprint": study.fingerprint("unknown")})
        group.attrs["finished"] = True
    return Finding(result, tuple(paragraphs))


def _plain(
    pool: SimulationPool,
    problem: Problem,
    fit: FitResult,
    offsets: Offsets,
    discrepancy: Discrepancy,
    unit: FloatArray,
) -> dict[str, FloatArray]:
    """White residuals of the fitted model, by recording."""
    out = {}
    for name in problem.fit_on:
        objective = Objective(pool, problem.space, [name], fit.noise, offsets, discrepancy=discrepancy)
        (white,) = objective.many(unit[None])
        if white is None:
            raise MuslinError(f"the best fit cannot be simulated on recording {name!r}; fit again")
        out[name] = white
    return out


def _unknowns(problem: Problem, names: Sequence[str]) -> tuple[Unknowns, Problem, list[Aim | None]]:
    """What is estimated, the problem that has it and the law as effects, and aims for a start."""
    size = 3 * (min(MOST_FUNCTIONS, FUNCTIONS // len(names)) // 3)
    bases, aims = [], []
    for name in names:
        scenario, recording = problem.scenarios[name], problem.recordings[name]
        held = np.concatenate([np.zeros(0, np.int64), *scenario.grasps])
        points = recording.series.points.shape[1]
        bases.append(make_basis(scenario.body, held, recording.series.time, size, points))
        aims.append(make_aim(recording, scenario, bases[-1]))
    effects = tuple(f"unknown-force-{k}" for k in range(len(names)))
    made = {e: field_effect(b, a) for e, b, a in zip(effects, bases, aims, strict=True)}
    full = replace(problem, effects={**problem.effects, LAW: REGISTRY.get("effect", LAW), **made})
    return Unknowns(problem.space, tuple(names), effects, tuple(bases), (0.0,) * len(names)), full, aims


def _objective(
    study: Study,
    pool: SimulationPool,
    unknowns: Unknowns,
    aims: list[Aim | None],
    fit: FitResult,
    offsets: Offsets,
    discrepancy: Discrepancy,
) -> tuple[ForceObjective, list[FloatArray]]:
    """Residuals of a model that is pulled as little as it must be, and starts: no force, and a first one."""
    unit = study.problem.space.to_unit(fit.estimate)
    values = fit.values()
    learned = [
        (np.zeros(len(b)), 0.0)
        if a is None
        else follow(pool, n, e, b, a, values, fit.noise.sd, partial(study.progress, f"following recording {n!r}"))
        for n, e, b, a in zip(unknowns.recordings, unknowns.effects, unknowns.bases, aims, strict=True)
    ]
    unknowns = replace(unknowns, pulls=tuple(pull for _, pull in learned))
    none = np.concatenate([unit, np.zeros(sum(map(len, unknowns.bases)))])
    starts = [none, np.concatenate([unit, *(force for force, _ in learned)])]
    progress = partial(study.progress, "estimating the missing force")
    return ForceObjective(pool, unknowns, fit.noise, offsets, discrepancy, progress), starts


def _law(
    study: Study, objective: ForceObjective, problem: Problem, estimate: Estimate, case: Case
) -> tuple[Case, LawDecision]:
    """Search the library for a law, refit the best ones, and decide."""
    law: type[Effect] = REGISTRY.get("effect", LAW)
    names = estimate.unknowns.recordings
    taken = tuple(n.removeprefix(f"{LAW}.") for n in problem.space.names if n.startswith(f"{LAW}."))
    pieces = pieces_of(law, taken, [problem.scenarios[n].times for n in names])
    study.progress("searching for a law", 0, 0)
    guesses = best_laws(estimate, responses(objective, law, pieces, estimate), pieces)
    parameters = {p.name.removeprefix(f"{LAW}."): p for p in law.parameters()}
    refits = Refits(objective.pool, problem, objective.noise, objective.offsets, objective.discrepancy, parameters)
    held: dict[int, RefittedLaw] = {}  # the best of each number of pieces: only a model left to itself compares them
    for k, guess in enumerate(guesses):
        study.progress("refitting laws", k + 1, len(guesses))
        law_held, size = refits.first(guess, estimate.point[: len(problem.space)], objective), len(guess.pieces)
        held[size] = min(held.get(size, law_held), law_held, key=lambda c: c.rss)
    laws: list[RefittedLaw] = []
    for size in sorted(held):
        study.progress("refitting the best law of each size", 0, 0)
        laws.append(refits.more(held[size]))
        if laws[-1].rss < (1 + NEGLIGIBLE) * case.count:  # a larger one would explain noise
            break
    laws = distinct(laws)
    case = replace(case, laws=tuple(laws), tried=len(pieces) ** len(KEPT))
    return case, decide(case)
