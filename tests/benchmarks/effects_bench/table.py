"""The figures of a benchmark run beside their bars: for people, and for the record."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from .scoring import ELSEWHERE, SHARES, Judged, held_out_left, held_out_over_noise, intervals, judged, wilson


@dataclass(frozen=True)
class Figure:
    """One line.

    Args:
        name: of the figure.
        value: None where there is no case.
        count: cases, or numbers, behind it.
        low, high: 95 % interval of a share (Wilson); None of what is no share.
        bar: as text.
        met: None where there is no bar, or no case.
        rivals: the same figure of each baseline; None where it has none.
    """

    name: str
    value: float | None
    count: int
    low: float | None = None
    high: float | None = None
    bar: str = ""
    met: bool | None = None
    rivals: dict[str, float | None] | None = None


def figures(records: Sequence[dict[str, Any]], rivals: Sequence[str]) -> list[Figure]:
    """Every figure of a run, of the diagnosis and of the baselines."""
    own = judged(records)
    others = {name: judged(records, name) for name in rivals}
    out = []
    for share in SHARES:
        hits, count = share.of(own)
        value = hits / count if count else None
        low, high = wilson(hits, count)
        met, bar = None, ""
        if share.bar is not None:
            sign, goal = share.bar
            bar = f"{sign} {100 * goal:.0f} %"
            if value is not None:
                met = value >= goal if sign == ">=" else value <= goal
        theirs = {n: _ratio(share.of(cases)) for n, cases in others.items()}
        out.append(Figure(share.name, value, count, low, high, bar, met, theirs))
    return [*out, *_numbers(own, records, rivals)]


def _ratio(pair: tuple[int, int]) -> float | None:
    return pair[0] / pair[1] if pair[1] else None


def _numbers(own: Sequence[Judged], records: Sequence[dict[str, Any]], rivals: Sequence[str]) -> list[Figure]:
    sizes = [float(len(j.answer.effects)) for j in own if j.case["kind"] == "known" and j.answer.effects]
    (errors, held), (_, there) = intervals(own), intervals(own, ELSEWHERE)
    cover = sum(held) / len(held) if held else None
    low, high = wilson(sum(held), len(held))
    over, left = held_out_over_noise(own), held_out_left(own)
    done = [r for r in records if "simulations" in r]
    cloth = [r for r in done if r["case"]["setting"].startswith("cloth")]
    rope = [r for r in done if r["case"]["setting"].startswith("rope")]
    ceilings = {n: _ceiling(own, n) for n in rivals}
    out = [
        Figure("names given where an effect of the library is hidden, mean", _mean(sizes), len(sizes)),
        Figure("coefficients: relative error, median", _median(errors), len(errors)),
        Figure(
            "coefficients: 90 % intervals that hold the truth",
            cover,
            len(held),
            low,
            high,
            "85 to 95 %",
            None if cover is None else 0.85 <= cover <= 0.95,
        ),
        Figure(
            "other engine: 90 % intervals that hold the truth",
            _mean(there),
            len(there),
            *wilson(sum(there), len(there)),
        ),
        _bounded("held-out error over noise, median", over, _median, 1.5, ceilings),
        _bounded("other engine: held-out error after over before, median", left, _median, 0.5),
        _bounded("simulations of a cloth case, most", [float(r["simulations"]) for r in cloth], _most, 1500),
        # ten minutes on two cores would be twenty of these; those on the clock depend on what runs beside
        _bounded("processor minutes of a cloth case, most", [r["processor_seconds"] / 60 for r in cloth], _most, 10),
        Figure("simulations of a rope case, median", _median([r["simulations"] for r in rope]), len(rope)),
        Figure("seconds of a rope case, median", _median([r["seconds"] for r in rope]), len(rope)),
        Figure("processor seconds of a rope case, median", _median([r["processor_seconds"] for r in rope]), len(rope)),
        Figure("simulations of a cloth case, median", _median([r["simulations"] for r in cloth]), len(cloth)),
        Figure("seconds of a cloth case, median", _median([r["seconds"] for r in cloth]), len(cloth)),
        Figure(
            "processor seconds of a cloth case, median", _median([r["processor_seconds"] for r in cloth]), len(cloth)
        ),
    ]
    return out


def _ceiling(own: Sequence[Judged], rival: str) -> float | None:
    """The median held-out error over noise of a baseline that predicts, on the rich cases."""
    from .scoring import RICH

    found = [
        j.record["baselines"][rival]["held_out"] / j.case["noise"]
        for j in own
        if RICH(j) and j.record.get("baselines", {}).get(rival, {}).get("held_out") is not None
    ]
    return _median(found)


def _bounded(
    name: str, values: Sequence[float], fold: Any, most: float, rivals: dict[str, float | None] | None = None
) -> Figure:
    value = fold(values)
    met = None if value is None else bool(value <= most)
    return Figure(name, value, len(values), bar=f"<= {most:g}", met=met, rivals=rivals)


def _mean(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if len(values) else None


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if len(values) else None


def _most(values: Sequence[float]) -> float | None:
    return float(np.max(values)) if len(values) else None


def markdown(found: Sequence[Figure], rivals: Sequence[str]) -> str:
    """The table, with a column for every baseline."""
    lines = [
        "| figure | value | cases | 95 % interval | bar | | " + "".join(f"`{r}` | " for r in rivals),
        "|---|---|---|---|---|---|" + "---|" * len(rivals),
    ]
    for f in found:
        is_share = f.low is not None
        interval = f"{100 * f.low:.1f} to {100 * f.high:.1f} %" if is_share and f.count else ""  # type: ignore[operator]
        met = "" if f.met is None else "met" if f.met else "**missed**"
        theirs = [shown((f.rivals or {}).get(r), is_share) for r in rivals]
        cells = [f.name, shown(f.value, is_share), str(f.count), interval, f.bar, met, *theirs]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def shown(value: float | None, is_share: bool) -> str:
    """A figure as the tables have it."""
    if value is None:
        return "–"
    if is_share:
        return f"{100 * value:.1f} %"
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def as_json(found: Sequence[Figure]) -> list[dict[str, Any]]:
    return [asdict(f) for f in found]
