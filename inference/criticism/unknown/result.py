"""What the step ``unknown`` says, for machines and for people."""

from typing import Any

import numpy as np

from ....core.registry import REGISTRY
from ....core.study import Problem
from ...noise import Noise
from .decision import Case, LawDecision
from .estimate import Estimate
from .library import scene_of
from .picture import worst_frame
from .refit import LAW, RefittedLaw

#: Of the table of terms; a law file of another version is refused.
VERSION = 1


def law_result(
    case: Case,
    estimate: Estimate | None,
    decision: LawDecision | None,
    problem: Problem,
    noise: Noise,
) -> dict[str, Any]:
    """The JSON of ``muslin unknown --json``.

    Args:
        case: of the plain model and the refitted laws.
        estimate: the force; None where there is no misfit to explain.
        decision: on the laws.
        problem: the study's.
        noise: of the measurement.
    """
    verdict = decision.verdict if decision else "no-misfit"
    stands = decision is not None and verdict != "none"
    return {
        "version": VERSION,
        "verdict": verdict,
        "law": law_table(case, decision.best) if decision and stands else None,
        "nearest": law_table(case, decision.best) if decision and not stands else None,
        "alternatives": [law_table(case, c) for c in decision.rivals] if decision else [],
        "force": _force_table(estimate, problem) if estimate else None,
        "error": {
            "noise": noise.sd,
            "held_out_before": _mean_error(case.held_out_plain),
            "held_out_after": _mean_error(decision.best.held_out) if decision and stands else None,
            "unit": noise.unit,
        },
    }


def _mean_error(errors: dict[str, float]) -> float | None:
    return float(np.sqrt(np.mean(np.square(list(errors.values()))))) if errors else None


def law_table(case: Case, law: RefittedLaw) -> dict[str, Any]:
    """One law: its terms with the unit and meaning of each, the parameters that go with it, and what it explains."""
    told = {c.name: c for c in REGISTRY.get("effect", LAW).coefficients}
    values = dict(zip(law.space.names, law.space.from_unit(law.fit.unit).tolist(), strict=True))
    return {
        "pieces": law.name,
        "terms": {
            name: {"mean": mean, "sd": sd, "unit": unit, "description": told[name].description}
            for name, (mean, sd, unit) in law.terms.items()
        },
        "at_end": list(law.at_end),
        "parameters": {p.name: values[p.name] for p in list(law.space)[: law.base]},
        "explained": case.explained(law),
        "explained_held_out": case.explained_held_out(law),
    }


def _force_table(estimate: Estimate, problem: Problem) -> dict[str, Any]:
    rows = {}
    for r, name in enumerate(estimate.unknowns.recordings):
        basis, times = estimate.unknowns.bases[r], problem.scenarios[name].times
        scene, masses = scene_of(problem, name, estimate.unknowns, estimate.point)
        acceleration = basis.accelerations(times, estimate.unknowns.force(estimate.point, r))
        acceleration[:, scene.held] = 0.0
        force = masses[:, None] * acceleration
        k = worst_frame(force)
        rows[name] = {
            "root_mean_square": float(np.sqrt((force**2).sum(axis=2).mean())),
            "over_weight": float(np.linalg.norm(force, axis=2).sum(axis=1).mean() / (9.80665 * masses.sum())),
            "pull": estimate.unknowns.pulls[r],
            "worst_time": float(times[k]),
            "worst_vertex": int(np.argmax(np.linalg.norm(force[k], axis=1))),
        }
    return {
        "explained": estimate.explained,
        "degrees": estimate.degrees(),
        "recordings": rows,
        "unit": "N",
    }


#: A held-out error above this many times the noise is more than noise.
_NOISE_ONLY = 1.15


def law_text(result: dict[str, Any]) -> tuple[str, ...]:
    """Paragraphs for people."""
    if result["verdict"] == "no-misfit":
        return ("The fitted model leaves no misfit beyond the noise: there is no missing force to look for.",)
    force = result["force"]
    lines = [
        f"A smooth force, on average {_mean(force, 'over_weight'):.2g} times the weight of the object, explains "
        f"{100 * force['explained']:.0f} % of the misfit of a model that is held to the recordings."
    ]
    lines += [
        f"  {name}: {row['root_mean_square']:.2g} N a vertex (root mean square), most at {row['worst_time']:.2f} s"
        for name, row in force["recordings"].items()
    ]
    law = result["law"]
    if law is None:
        near = result["nearest"]
        lines.append("No simple law was found for it: nothing that was tried holds up.")
        lines.append(f"The nearest, {near['pieces']}, explains {_shares(near)}.")
        return tuple(lines)
    lines.append(f"It follows a law, {law['pieces']}: acceleration = the sum of")
    lines += [
        f"  {n} = {t['mean']:.4g} ± {t['sd']:.2g} {t['unit']}: {t['description']}" for n, t in law["terms"].items()
    ]
    lines += _place(law["terms"])
    lines.append(f"This explains {_shares(law)}.")
    if law["at_end"]:
        lines.append(
            f"The range that is searched ends at {' and '.join(law['at_end'])}: more is missing than the library "
            "reaches to, and other terms may stand in for it."
        )
    if result["verdict"] == "unchecked":
        lines.append("No recording is held out, so nothing has checked it: add one to [study] hold_out.")
    error = result["error"]
    if error["held_out_after"] is not None:
        scale, unit = (1e3, "mm") if error["unit"] == "m" else (1.0, error["unit"])
        before, after, noise = (scale * error[k] for k in ("held_out_before", "held_out_after", "noise"))
        told = f"Held-out error {before:.2f} -> {after:.2f} {unit}, noise {noise:.2f} {unit}."
        if np.isinf(before):
            told = (
                "Held-out recordings cannot all be simulated without it; with it their error is "
                f"{after:.2f} {unit}, noise {noise:.2f} {unit}."
            )
        lines.append(told)
        if error["held_out_after"] > _NOISE_ONLY * error["noise"]:
            lines.append(
                "What it leaves there is more than noise: it predicts, but take its terms as a description, not as the "
                "law itself."
            )
    lines += [f"These recordings cannot tell it from: {a['pieces']} ({_shares(a)})." for a in result["alternatives"]]
    return tuple(lines)


def _mean(force: dict[str, Any], key: str) -> float:
    return float(np.mean([row[key] for row in force["recordings"].values()]))


def _place(terms: dict[str, Any]) -> list[str]:
    """Where springs pull to: the acceleration beside them moves their centre."""
    mean = {name: t["mean"] for name, t in terms.items()}
    stiffness = {e: mean.get("spring", 0.0) + mean.get(f"spring_{e}", 0.0) for e in "xyz"}
    away = {e: mean.get(f"acceleration_{e}", 0.0) / k for e, k in stiffness.items() if k > 0}
    if not any(away.values()):
        return []
    told = ", ".join(f"{e} {a:.3f}" for e, a in away.items())
    return [f"With the acceleration its spring pulls to {told} m from the centre of the start."]


def _shares(law: dict[str, Any]) -> str:
    held = law["explained_held_out"]
    more = "" if held is None else f" and {100 * held:.0f} % on held-out ones"
    if held is not None and held < 0:
        more = ", but makes held-out ones worse"
    return f"{100 * law['explained']:.0f} % of the excess misfit on fitted recordings{more}"
