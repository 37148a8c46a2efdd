"""A diagnosis in words."""

from typing import Any

import numpy as np

from ...core.effect import Effect
from .verdict import EXPLAINS, Evidence


def explain(
    result: dict[str, Any], effects: dict[str, type[Effect]], evidence: Evidence, together: float, held_out: int
) -> list[str]:
    """Paragraphs for people: the verdict first, then what it rests on and what could not be seen.

    Args:
        result: the JSON of the diagnosis.
        effects: classes by name.
        evidence: of the first stage.
        together: share of the excess misfit that everything named explains.
        held_out: number of held-out recordings.
    """
    error = result["error"]
    where = "held-out error" if held_out else "error on the fitted recordings"
    verdict, named = result["verdict"], result["effects"]
    ratio = np.sqrt(evidence.rss_plain / evidence.count)
    out: list[str] = []
    if verdict == "named":
        rows = [c for n in named for c in result["candidates"] if c["name"] == n]
        out.append(
            f"Missing: {' and '.join(named)}. The object {' and '.join(effects[n].symptom for n in named)}; "
            f"{' and '.join(named)} {'explains' if len(named) == 1 else 'together explain'} "
            f"{100 * together:.0f} % of the excess misfit, {'; '.join(_coefficients(c) for c in rows)}; {where} "
            f"{length(error['before'], error['unit'])} → {length(error['after'], error['unit'])}, "
            f"noise {length(error['noise'], error['unit'])}."
        )
    elif verdict == "tied":
        out.append(
            f"Tied: {' and '.join(named)}. The object {effects[named[0]].symptom}; each explains the misfit about as "
            f"well ({'; '.join(_share(result, n) for n in named)}), and these data cannot tell them apart. "
            f"With {named[0]}, {where} {length(error['before'], error['unit'])} → "
            f"{length(error['after'], error['unit'])}, noise {length(error['noise'], error['unit'])}. "
            "A motion that excites them differently would decide: faster, at another frequency, or held still."
        )
    elif verdict == "none":
        best = result["candidates"][0]
        out.append(
            f"The model misses something, but none of the candidates is it: the misfit is {ratio:.1f} times the noise, "
            f"and the best candidate, {best['name']}, explains {100 * best['explained']:.0f} % of the excess "
            f"(at least {100 * EXPLAINS:.0f} % is asked, on motions it was not fitted to as well)."
        )
    elif verdict == "no-misfit":
        out.append(
            f"No misfit: the model differs from the measurement by {ratio:.2f} times the noise of "
            f"{length(error['noise'], error['unit'])}, which is what noise alone does."
        )
    else:
        out.append(
            "Cannot tell: the model fits, but these data would fit as well if an effect of ordinary strength were "
            "missing. Record a motion that excites the object more."
        )
    told_already = named if verdict != "none" else [result["candidates"][0]["name"]]
    rivals = [c for c in result["candidates"] if c["name"] not in told_already and c["explained"] > 0.2]
    if verdict in ("named", "none") and rivals:
        told = ", ".join(f"{c['name']} ({100 * c['explained']:.0f} %)" for c in rivals[:3])
        out.append(f"Tried and less able: {told}.")
    hidden = [c.name for c in evidence.candidates if not c.visible]
    if hidden:
        out.append(f"Not visible in these data, so neither ruled in nor out: {', '.join(sorted(hidden))}.")
    return out


def _share(result: dict[str, Any], name: str) -> str:
    candidate = next(c for c in result["candidates"] if c["name"] == name)
    return f"{name} {100 * candidate['explained']:.0f} % of the excess, with {_coefficients(candidate)}"


def length(value: float, unit: str) -> str:
    """A length for people: millimetres for metres."""
    return f"{1e3 * value:.1f} mm" if unit == "m" else f"{value:.2f} {unit}"


def _coefficients(candidate: dict[str, Any]) -> str:
    parts = []
    for name, c in candidate["coefficients"].items():
        unit = "" if c["unit"] == "1" else f" {c['unit']}"
        parts.append(f"{name.replace('_', ' ')} {c['mean']:.3g} ± {c['sd']:.1g}{unit}")
    return ", ".join(parts)
