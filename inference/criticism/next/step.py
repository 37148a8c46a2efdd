"""The step ``next``: which motion to record next?"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2, norm

from ....core.arrays import FloatArray
from ....core.errors import InputError
from ....core.motion import Motion
from ....core.parameters import ParameterSpace
from ....core.registry import REGISTRY
from ....core.store import put, read, storage_errors
from ....core.study import Problem, Study
from ....core.study.windows import joined
from ...sequential.polishing import offsets_of
from ...sequential.result import FitResult, load_fit
from ..told import Told
from ..verdict import MARGIN, SIGNIFICANT
from .bench import Bench, Proposal
from .goal import Goal
from .limits import Limits, limits_within
from .opening import Opening, opening_of, tied_rivals
from .playing import peaks_of, write_motion
from .rivals import Rival, kept_rival, knowing, leads_of
from .search import Found, Search
from .shapes import Known, fastest_swing, known_shapes
from .words import SURE, TELLS, explain

#: Rollouts of a search where nothing else is said, and fewer than which find nothing.
SIMULATIONS, LEAST_SIMULATIONS = 400, 30
#: Below this probability a motion is not worth recording, unless several takes of it are.
HOPELESS = 0.005


@dataclass(frozen=True, eq=False)
class NextExperiment(Told):
    """What :func:`propose_next` found.

    Args:
        motion: proposed; None if there is none.
    """

    motion: Motion | None

    def write(self, path: str | Path) -> None:
        """Write the motion for a robot; see :func:`~.playing.write_motion`.

        Raises:
            InputError: no motion is proposed.
        """
        if self.motion is None:
            raise InputError(f"no motion is proposed, so there is nothing to write to {path}")
        write_motion(self.motion, Path(path))


def propose_next(
    study: Study, *, effects: Sequence[str] = (), simulations: int = SIMULATIONS, **asked: Any
) -> NextExperiment:
    """Propose the motion that settles what a diagnosis left open.

    Args:
        study: fitted; diagnosed, unless ``effects`` are given.
        effects: to be told apart, or one to be seen; default what the diagnosis left tied, else what it could not see.
        simulations: rollouts of the search; models that must be refitted come on top.
        asked: limits of the robot, see :func:`~.limits.limits_within`.

    Raises:
        StepMissingError: the study has not been fitted, or not diagnosed.
        InputError: nothing holds the object, an effect cannot act here, or limits that no motion can keep.
    """
    began = time.monotonic()
    if simulations < LEAST_SIMULATIONS:
        raise InputError(f"{simulations} simulations find nothing; take at least {LEAST_SIMULATIONS}")
    problem = study.problem
    scenario = problem.scenarios[problem.fit_on[0]]
    if not scenario.grasps:
        raise InputError(f"{study.path}: no gripper holds the object, so there is no motion to propose")
    whole = joined(problem.scenarios, problem.cut_from)  # a robot is moved from where a recording starts, not a piece
    limits = limits_within(whole.values(), **asked)
    fit, opening = load_fit(study), opening_of(study, effects)
    study.check_writable()
    noise = fit.noise
    known = knowing(problem, {n: REGISTRY.get("effect", n) for n in opening.all_effects})
    goal, spent = _goal(study, known, fit, opening)
    if goal is not None and (decided := goal.decided()) is not None:
        opening, goal = replace(opening, purpose="nothing", reason=decided), None
    found = Found(None, [], 0, 0)
    frame_rate = 1.0 / float(np.median(np.diff(problem.recordings[problem.fit_on[0]].series.time)))
    times = np.arange(int(limits.duration * frame_rate + 1e-9) + 1) / frame_rate
    if goal is not None:
        bench = Bench(
            study, known, scenario, times, goal.models, noise, offsets_of(study), shared=goal.purpose == "unseen"
        )
        start = scenario.motion.at(scenario.times[:1])[0]
        search = Search(bench, goal, limits, start, fastest_swing(limits, frame_rate), study.config.study.seed)
        found = search.run(known_shapes(whole, limits), simulations)
        spent += bench.count
    result = _result(study, opening, limits, found, goal, spent, time.monotonic() - began)
    paragraphs = explain(result, limits.text())
    best = found.best if result["probability"] >= HOPELESS or result["takes"] else None
    _save(study, result, paragraphs, best, [] if goal is None else [m.name for m in goal.models], times)
    return NextExperiment(result, tuple(paragraphs), None if best is None else best.motion)


def _goal(study: Study, problem: Problem, fit: FitResult, opening: Opening) -> tuple[Goal | None, int]:
    """What a motion has to do, and the rollouts that it took to know."""
    if opening.purpose == "nothing":
        return None, 0
    group = study.step_results("fit")
    unit, covariance = read(group, "estimate_unit"), read(group, "estimate_covariance")
    plain = Rival("the model as it is", study.problem.space, unit, covariance)
    if opening.purpose == "tied":
        models, spent = tied_rivals(study, problem, fit, plain.unit, opening)
        # a lead that did not decide, as more than noise is left or held-out motions say otherwise, never will
        lead = np.maximum(leads_of(models), 0.0) if opening.undecided else 0.0
        return Goal("tied", tuple(models), np.full((len(models), len(models)), MARGIN) + lead), spent
    named = kept_rival(problem, opening.beside, opening.models) if opening.beside else None
    return _unseen_goal(problem, named or plain, opening), 0


def _unseen_goal(problem: Problem, plain: Rival, opening: Opening) -> Goal:
    """The model as it is, and with each effect: seen if a diagnosis of as many candidates would find it significant."""
    models, thresholds = [plain], [0.0]
    for name in opening.effects:
        extra = ParameterSpace(problem.effects[name].parameters())
        models.append(plain.with_strength(name, extra))
        tail = 2.0 * norm.sf(SIGNIFICANT) / opening.candidates
        thresholds.append(float(chi2.isf(tail, len(extra))))
    return Goal("unseen", tuple(models), np.array(thresholds)[:, None] * np.eye(len(models))[:1])


def _result(
    study: Study, opening: Opening, limits: Limits, found: Found, goal: Goal | None, spent: int, seconds: float
) -> dict[str, Any]:
    best = found.best
    about: dict[str, Any] = {
        "purpose": opening.purpose,
        "reason": opening.reason,
        "effects": list(opening.effects),
        "beside": list(opening.beside),
        "tells": False,
        "probability": 0.0,
        "probabilities": {},
        "takes": None,
        "repeat": None,
        "motion": None,
    }
    if best is not None and goal is not None:
        shares = goal.probabilities(best.views)
        worst = float(shares.min()) if goal.purpose == "tied" else float(shares.max())
        about.update(
            tells=worst >= TELLS,
            probability=worst,
            probabilities=dict(zip(goal.names, shares.tolist(), strict=True)),
            takes=goal.takes_for(best.views, SURE) if goal.purpose == "tied" else None,
            repeat=_repeat(found, goal) if goal.purpose == "tied" else None,
            motion=_motion(best, limits),
        )
    return {
        **about,
        "limits": limits.as_dict(),
        "correspondence": study.problem.recordings[study.problem.fit_on[0]].series.correspondence,
        "tried": found.tried,
        "failed": found.failed,
        "simulations": spent,
        "seconds": seconds,
        "seed": study.config.study.seed,
    }


def _repeat(found: Found, goal: Goal) -> dict[str, Any] | None:
    """The best of the motions that were recorded already, and what recording it again would do."""
    again = [p for p in found.known if isinstance(p.shape, Known) and p.shape.recorded]
    if not again:
        return None
    best = max(again, key=lambda p: goal.value(p.views))
    return {"name": best.shape.name, "probability": float(goal.probabilities(best.views).min())}


def _motion(best: Proposal, limits: Limits) -> dict[str, Any]:
    peaks = peaks_of(best.motion)
    away = best.motion.poses[..., :3] - best.motion.poses[:1, :, :3]
    return {
        "name": best.shape.name,
        "grippers": best.motion.grippers,
        "duration": limits.duration,
        "rate": limits.rate,
        "peak_speed": peaks["speed"],
        "peak_acceleration": peaks["acceleration"],
        "turn": peaks["turn"] if peaks["turn"] > 1e-6 else 0.0,
        "reach": [[float(away[..., a].min()), float(away[..., a].max())] for a in range(3)],
        "start": best.motion.poses[0].tolist(),
        "units": {"time": "s", "position": "m", "quaternion": "w x y z"},
    }


def _save(
    study: Study,
    result: dict[str, Any],
    paragraphs: list[str],
    best: Proposal | None,
    models: list[str],
    times: FloatArray,
) -> None:
    with storage_errors(study.results_path):
        group = study.results("r+").create_group("next", overwrite=True)
        if best is not None:
            put(group, "time", best.motion.times, ["time"], "s")
            put(group, "gripper_pose", best.motion.poses, ["time", "gripper", "component"], "m")
            if best.points is not None:
                put(group, "frame_time", times, ["frame_time"], "s")
                put(group, "predicted", best.points, ["model", "frame_time", "point", "axis"], "m")
                group.attrs["models"] = models
        group.attrs.update({"result": result, "text": paragraphs, "fingerprint": study.fingerprint("next")})
        group.attrs["finished"] = True
