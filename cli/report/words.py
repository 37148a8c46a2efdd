"""Numbers and findings in words."""

import math
from typing import Any

from ...core.errors import MuslinError
from ...core.registry import REGISTRY
from .findings import Findings, Table, number

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
NBSP = "\u00a0"


def shown_unit(unit: str) -> tuple[float, str]:
    """Factor and unit for people: lengths in millimetres."""
    return (1000.0, "mm") if unit == "m" else (1.0, unit)


def length(value: Any, unit: str = "m") -> str:
    """An error with its unit, to two or three figures."""
    factor, label = shown_unit(unit)
    x = number(value)
    return f"{plain(x * factor)}{NBSP}{label}" if x is not None else "–"


def fall(before: float, after: float, unit: str = "m") -> str:
    """What became of an error: it falls, rises or stays; to a tenth where whole millimetres do not tell."""
    told = [length(before, unit), length(after, unit)]
    if told[0] == told[1]:
        factor, label = shown_unit(unit)
        told = [f"{x * factor:.1f}{NBSP}{label}" for x in (before, after)]
    if told[0] == told[1]:
        return f"stays at {told[0]}"
    return f"{'rises' if after > before else 'falls'} from {told[0]} to {told[1]}"


def plain(x: float) -> str:
    """About two significant figures, never an exponent for everyday sizes."""
    if x == 0:
        return "0"
    if abs(x) >= 9.95:
        return f"{x:.0f}" if abs(x) < 1e5 else scientific(x, 2)
    if abs(x) >= 0.01:
        return f"{x:.1f}" if abs(x) >= 0.995 else f"{x:.2g}"
    return scientific(x, 2)


def scientific(x: float, figures: int) -> str:
    """``1.4 × 10⁻⁵``."""
    mantissa, exponent = f"{x:.{max(figures - 1, 0)}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"{mantissa} × 10{str(int(exponent)).translate(_SUPERSCRIPT)}".replace("-", "−")


def value(x: Any, unit: str = "1") -> str:
    """One number with a unit, to three figures."""
    v = number(x)
    if v is None:
        return "–"
    text = "0" if v == 0 else f"{v:.3g}" if 1e-3 <= abs(v) < 1e4 else scientific(v, 3)
    return with_unit(f"{v:,.0f}".replace(",", "\u202f") if 1e3 <= abs(v) < 1e7 else text, unit)


def with_unit(text: str, unit: str) -> str:
    """A number and its unit, kept on one line."""
    return text.replace("-", "−") if unit in ("1", "-", "") else f"{text.replace('-', '−')}{NBSP}{unit}"


def spread(mean: Any, sd: Any, unit: str = "1") -> str:
    """``mean ± sd``, rounded to where the sd says."""
    m, s = number(mean), number(sd)
    if m is None or s is None or s <= 0:
        return value(m, unit)
    exponent = math.floor(math.log10(max(abs(m), s)))
    if not -3 <= exponent < 4:
        ten = 10.0**exponent
        power = f"10{str(exponent).translate(_SUPERSCRIPT)}"
        return with_unit(f"({_rounded(m / ten, s / ten)}) × {power}", unit)
    return with_unit(_rounded(m, s), unit)


def _rounded(m: float, s: float) -> str:
    digits = -math.floor(math.log10(s))
    if s * 10**digits < 1.95:
        digits += 1
    if digits <= 0:
        return f"{round(m, digits):.0f}{NBSP}±{NBSP}{round(s, digits):.0f}"
    return f"{m:.{digits}f}{NBSP}±{NBSP}{s:.{digits}f}"


def words(name: str) -> str:
    """A plugin or coefficient name as people write it."""
    return name.replace("-", " ").replace("_", " ").replace(".", ": ", 1)


def symptom(effect: str) -> str:
    """What one sees when the effect is missing, or "" if its plugin cannot be asked."""
    try:
        return str(getattr(REGISTRY.get("effect", effect), "symptom", ""))
    except MuslinError:
        return ""


def share(x: Any) -> str:
    """A fraction in percent."""
    v = number(x)
    return f"{100 * v:.0f}{NBSP}%" if v is not None else "–"


def coefficients(candidate: Table) -> list[str]:
    """Each coefficient as ``name mean ± sd unit``."""
    return [
        f"{words(n)} {spread(c.get('mean'), c.get('sd'), str(c.get('unit', '1')))}"
        for n, c in (candidate.get("coefficients") or {}).items()
    ]


def unseen(candidate: Table) -> bool:
    """These data could not have shown this candidate."""
    own = number(candidate.get("identifiability"))
    return own <= 0.0 if own is not None else candidate.get("z") is None


def identifiability(candidate: Table) -> str:
    """How well these data can show a candidate."""
    own = number(candidate.get("identifiability"))
    if unseen(candidate):
        return "no: too weak, or hidden by the parameters"
    return "–" if own is None else f"yes: {share(own)} of its trace is unlike the parameters"


def sentence(candidate: Table, unit: str, noise: Any, thing: str = "object", *, errors: bool = True) -> str:
    """The finding about one candidate, as a person would say it; ``errors`` adds those before and after."""
    parts = []
    seen = symptom(str(candidate["name"]))
    if seen:
        parts.append(f"The {thing} {seen}")
    name, text = words(str(candidate["name"])), "; ".join(coefficients(candidate))
    if number(candidate.get("explained")) is not None:
        said = f"{name} explains {share(candidate['explained'])} of the excess error" + (f", {text}" if text else "")
    else:
        said = f"{name}: {text}" if text else name
    parts.append(said)
    before, after = number(candidate.get("held_out_before")), number(candidate.get("held_out_after"))
    if errors and before is not None and after is not None:
        floor = f", noise {length(noise, unit)}" if number(noise) is not None else ""
        parts.append(f"held-out error {length(before, unit)} → {length(after, unit)}{floor}")
    out = "; ".join(parts) + "."
    return out[0].upper() + out[1:]


def errors(found: Findings) -> Table:
    """The headline errors: ``before``, ``after``, ``noise``, ``unit`` and on which recordings (``on``)."""
    held = [t for t in found.takes if t.held_out]
    takes = held or found.takes
    said = dict((found.diagnose or {}).get("error") or {})
    out: Table = {"on": "held-out" if held or not takes else "fitted", "unit": said.get("unit", "m")}
    mean = _root_mean([t.rmse for t in takes])
    noise = _root_mean([t.noise for t in takes])
    fitted = found.fit.attrs.get("noise") or {}
    floors = (number(said.get("noise")), noise, number(fitted.get("sd")))
    out["noise"] = next((n for n in floors if n is not None), None)
    out["before"], out["after"] = mean, None
    named = (found.diagnose or {}).get("verdict") in ("named", "tied")
    if found.after_inferred:
        out["after"] = _root_mean([t.rmse_after for t in takes])
    elif said:
        out["before"] = number(said.get("before")) or mean
        out["after"] = number(said.get("after")) if named else None
    if takes and not said:
        out["unit"] = takes[0].unit
    return out


def _root_mean(values: list[float | None]) -> float | None:
    known = [v for v in values if v is not None]
    return math.sqrt(sum(v * v for v in known) / len(known)) if known and len(known) == len(values) else None
