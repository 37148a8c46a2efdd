"""Whether the box of the prior cuts the posterior off, and what to do about it."""

from dataclasses import dataclass

import numpy as np

from ...core.arrays import FloatArray
from ...core.parameters import Parameter, ParameterSpace

#: A marginal that is this many times as dense at a bound as it is over the whole box speaks for that bound.
SPEAKS = 2.0
#: ... and is cut off by it if it is at least this part as dense there as anywhere: half is 1.2 standard deviations
#: from the top of a Gaussian, so that an eighth of it lies beyond.
CUT = 0.5
#: Width of what is taken for the bound, in standard deviations of the marginal and at most, in parts of the box.
_NEAR, _WIDEST = 0.3, 0.05
#: A best fit this near to a bound lies on it, if its standard deviation is below that of a vague one.
_ON, _VAGUE = 0.01, 0.15


@dataclass(frozen=True)
class AtBound:
    """A parameter that the prior's box holds back.

    Args:
        index: of the parameter.
        upper: whether it is the upper bound.
        by: ``"posterior"`` or ``"best fit"``.
    """

    index: int
    upper: bool
    by: str


def at_bounds(samples: FloatArray, best: FloatArray, best_sd: FloatArray) -> list[AtBound]:
    """Parameters whose marginal rises towards a bound, or whose best fit lies on one.

    A flat marginal, or one that is slightly tilted, says nothing about a bound and is not meant.

    Args:
        samples: of the posterior ``(S, D)``, in the unit cube.
        best: best fit ``(D,)`` in the unit cube.
        best_sd: its standard deviation ``(D,)`` there.
    """
    out = []
    for k in range(samples.shape[1]):
        for upper in (False, True):
            if cut_off(1.0 - samples[:, k] if upper else samples[:, k]):
                out.append(AtBound(k, upper, "posterior"))
            elif best_sd[k] < _VAGUE and (1.0 - best[k] if upper else best[k]) < _ON:
                out.append(AtBound(k, upper, "best fit"))
    return out


def cut_off(draws: FloatArray) -> bool:
    """Whether draws ``(S,)`` on the unit interval are piled on zero, beyond what chance makes of so many."""
    width = float(np.clip(_NEAR * draws.std(), 1e-6, _WIDEST))
    ordered = np.sort(draws)
    starts = np.arange(0.0, 1.0 - width, width / 2)
    counts = np.searchsorted(ordered, starts + width) - np.searchsorted(ordered, starts)
    at, most = int(counts[0]), int(counts.max())
    sure = at - 2.0 * np.sqrt(at)  # two standard deviations of a count
    return bool(sure > SPEAKS * width * len(draws) and sure > CUT * most - 2.0 * np.sqrt(most))


def bound_notes(space: ParameterSpace, found: list[AtBound]) -> list[str]:
    """Sentences for people: which bound, and a wider one to try."""
    notes = []
    for a in found:
        p = list(space)[a.index]
        side, key, bound = ("upper", "high", p.high) if a.upper else ("lower", "low", p.low)
        what = "the posterior is piled on" if a.by == "posterior" else "the best fit lies on"
        wider = _wider(p, a.upper)
        then = (
            f"widen it ([{_table(p)}] {key} = {wider:.3g}) and fit again; if it stays there, an effect is missing"
            if wider is not None
            else "it cannot be lower than zero, so an effect is missing: muslin diagnose"
        )
        notes.append(
            f"{p.name}: {what} the {side} bound of its prior, {bound:g} {p.unit if p.unit != '1' else ''}".rstrip()
            + f": {then}"
        )
    return notes


def _table(p: Parameter) -> str:
    return f"effects.{p.name}" if "." in p.name else f"parameters.{p.name}"


def _wider(p: Parameter, upper: bool) -> float | None:
    """A bound that doubles the box, or is a decade further on a log scale; None below zero."""
    if p.scale == "log":
        return p.high * 10.0 if upper else p.low / 10.0
    if upper:
        return p.high + (p.high - p.low)
    if p.low == 0.0:
        return None
    return p.low - (p.high - p.low) if p.low < 0 else max(0.0, p.low - (p.high - p.low))
