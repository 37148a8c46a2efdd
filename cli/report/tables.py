"""Rows of the tables, with every number already in words."""

import numpy as np

from .findings import Findings, Posterior, Table, number
from .words import (
    coefficients,
    errors,
    identifiability,
    length,
    plain,
    share,
    shown_unit,
    spread,
    unseen,
    value,
    with_unit,
    words,
)


def key_figures(found: Findings) -> list[Table]:
    """The few figures on top: ``label``, ``value`` and a small ``note``."""
    e, out = errors(found), []
    factor, unit = shown_unit(e["unit"])
    before, after, noise = (number(e[k]) for k in ("before", "after", "noise"))
    if before is not None:
        arrow = "" if after is None else f"{plain(before * factor)} → "
        last = plain((before if after is None else after) * factor)
        note = f"with {found.after_label}" if after is not None and found.after_name else ""
        out.append({"label": f"{e['on']} error", "from": arrow, "value": last, "unit": unit, "note": note})
    if noise is not None:
        source = (found.fit.attrs.get("noise") or {}).get("source", "")
        note = f"from {source}" if source else ""
        out.append({"label": "noise floor", "from": "", "value": plain(noise * factor), "unit": unit, "note": note})
    effect = _effect_figure(found)
    if effect:
        out.append(effect)
    d = found.diagnose or {}
    parts = [(found.fit.attrs, "fit"), *([(d, "diagnosis")] if d else [])]
    for key, label in (("simulations", "simulations"), ("seconds", "seconds")):
        known = [(number(t.get(key)), what) for t, what in parts]
        figures = [(n, what) for n, what in known if n is not None]
        if figures:
            note = " + ".join(f"{n:.0f} {what}" for n, what in figures) if len(figures) > 1 else figures[0][1]
            total = value(float(round(sum(n for n, _ in figures))))
            out.append({"label": label, "from": "", "value": total, "unit": "", "note": note})
    return out


def _effect_figure(found: Findings) -> Table | None:
    shown = (found.diagnose or {}).get("effects") or []
    if (found.diagnose or {}).get("verdict") != "named" or not shown:
        return None
    best = next((c for c in found.candidates if c["name"] == shown[0]), None)
    if best is None or not best.get("coefficients"):
        return {"label": "effect", "from": "", "value": words(shown[0]), "unit": "", "note": ""}
    name, c = next(iter(best["coefficients"].items()))
    text = spread(c.get("mean"), c.get("sd"), str(c.get("unit", "1")))
    return {"label": words(shown[0]), "from": "", "value": text, "unit": "", "note": words(name)}


def parameter_rows(fit: Posterior, after: Posterior | None = None) -> list[Table]:
    """One row a parameter; ``after`` adds its column, and the parameters that only it has."""
    out = []
    for source in [fit] if after is None else [fit, after]:
        a = source.attrs
        for i, name in enumerate(source.names):
            if source is not fit and name in fit.names:
                continue
            unit = str(a["units"][i])
            end = with_unit(value(a["high"][i]), unit)
            row = {
                "name": words(name),
                "prior": f"{value(a['low'][i])} to {end}{', log' if a['scale'][i] == 'log' else ''}",
                "posterior": _mean_sd(source, i, unit) if source is fit else "not in the model",
                "estimate": spread(source.estimate[i], source.estimate_sd[i], unit) if source is fit else "–",
                "at_bound": source is fit and name in (a.get("at_bound") or []),
                "after": "",
                "after_at_bound": False,
            }
            if after is not None and name in after.names:
                row["after"] = _mean_sd(after, after.names.index(name), unit)
                row["after_at_bound"] = name in (after.attrs.get("at_bound") or [])
            out.append(row)
    return out


def _mean_sd(fit: Posterior, i: int, unit: str) -> str:
    draws = fit.samples[:, i]
    return spread(float(np.mean(draws)), float(np.std(draws)), unit)


def recording_rows(found: Findings) -> list[Table]:
    """Errors of one recording a row, and bar widths in percent of the largest."""
    known = [v for t in found.takes for v in (t.rmse, t.rmse_after, number(t.row.get("default"))) if v is not None]
    top = max([*known, 1e-12])

    def width(x: float | None) -> float:
        return round(100 * (x or 0.0) / top, 1)

    return [
        {
            "name": t.name,
            "role": "held out" if t.held_out else "fit",
            "baseline": length(t.row.get("baseline"), t.unit),
            "default": length(t.row.get("default"), t.unit),
            "before": length(t.rmse, t.unit),
            "after": length(t.rmse_after, t.unit),
            "noise": length(t.noise, t.unit),
            "worst": f"{length(float(t.before[t.worst_frame]), t.unit)} at {t.time[t.worst_frame]:.2f} s",
            "point": t.row.get("worst_point"),
            "width_before": width(t.rmse),
            "width_after": width(t.rmse_after),
            "width_noise": width(t.noise),
        }
        for t in found.takes
    ]


def candidate_rows(found: Findings) -> list[Table]:
    """One candidate effect a row, best first."""
    e = errors(found)
    d = found.diagnose or {}
    named = set(d.get("effects") or [])
    seen = {*named, *(d.get("further") or [])}  # as strong as they are here
    rows = []
    for c in found.candidates:
        blind = unseen(c)
        rows.append(
            {
                "name": words(str(c["name"])),
                "named": c["name"] in named,
                "coefficients": coefficients(c),
                "explained": "not tried"
                if d.get("budget_spent") and not c.get("tried", True)
                else share(c.get("explained")),
                "width": round(100 * min(max(number(c.get("explained")) or 0.0, 0.0), 1.0), 1),
                "z": _z(c.get("z")),
                "after": length(c.get("held_out_after"), e["unit"]),
                "identifiability": "only if as strong as here" if blind and c["name"] in seen else identifiability(c),
                "unseen": blind and c["name"] not in seen,
            }
        )
    return rows


def _z(z: object) -> str:
    known = number(z)
    if known is not None:
        return f"{known:.1f}".replace("-", "−") if abs(known) < 100 else f"{known:.0f}"
    return "–" if z is None else ">\u00a037" if str(z).lower() in ("inf", "infinity") else "–"
