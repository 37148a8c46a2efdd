"""Print what every recorded batch of hidden effects came to: one row each, of what ``effects.py`` wrote.

A batch has seeds of its own, which nothing was improved on before it ended; what was learned from one is in the code
of the next. ::

    python tests/benchmarks/effects_batches.py
"""

import json
from typing import Any

from effects_bench.scoring import wilson
from table import RESULTS, row

#: Figures that are shares, and what the columns say of them.
COLUMNS = {
    "truth among the names given": "own engine: the effect is among the names given",
    "other engine: top-1": "other engine: it comes first",
    "right where one name is given": "right where one name is given",
    "a name where nothing is hidden": "a name where nothing is hidden",
    "'none' where the effect is unknown": "*none* where no library has it",
    "'tied' where two look alike": "*tied* where two look alike",
    "'cannot-tell' where the data are poor": "*cannot-tell* where the data are poor",
    "both of two effects named": "both of two named",
    "coefficients: 90 % intervals that hold the truth": "coefficients within their 90 % intervals",
}

#: The batches whose code gives no name that makes held-out motions worse, as today's, begin here.
SINCE = 980_000
LARGER = "names that make the held-out error larger"


def batches() -> list[str]:
    """The table as lines of Markdown."""
    heads = ["first seed", "commit", "cases", *COLUMNS.values(), LARGER]
    lines = [row(heads), "|---" * len(heads) + "|"]
    for content in _contents():
        found = {f["name"]: f for f in content["figures"]}
        ended = sum("verdict" in c for c in content["cases"])
        shares = [_share(found[name]) for name in COLUMNS]
        lines.append(row([str(content["seeds"][0]), content["commit"], str(ended), *shares, _larger(content["cases"])]))
    return lines


def together() -> list[str]:
    """The batches since :data:`SINCE` as one, every figure that has a bar, as lines of Markdown."""
    latest = [c for c in _contents() if c["seeds"][0] >= SINCE]
    seeds = ", ".join(str(c["seeds"][0]) for c in latest)
    ended = sum("verdict" in case for c in latest for case in c["cases"])
    heads = [f"{ended} cases of the batches {seeds}", "value", "95 % interval", "bar"]
    lines = [row(heads), "|---" * len(heads) + "|"]
    for first in latest[0]["figures"]:
        each = [f for c in latest for f in c["figures"] if f["name"] == first["name"] and f["count"]]
        if not first["bar"] or not each:
            continue
        if first["low"] is None:  # a median or the most of a batch
            low, high = min(f["value"] for f in each), max(f["value"] for f in each)
            told = f"{low:.3g} to {high:.3g}, by batch" if "median" in first["name"] else f"{high:.4g}"
            lines.append(row([first["name"], told, "", _against(first["bar"], high)]))
            continue
        hits, count = sum(round(f["value"] * f["count"]) for f in each), sum(f["count"] for f in each)
        interval = "{:.0f} to {:.0f} %".format(*(100 * end for end in wilson(hits, count)))
        lines.append(row([first["name"], f"{hits} of {count}", interval, _against(first["bar"], 100 * hits / count)]))
    return lines


def _against(bar: str, value: float) -> str:
    """A bar, ``>= 98 %``, ``<= 1.5`` or ``85 to 95 %``, and whether a value meets it."""
    words = bar.removesuffix(" %").split()
    if words[1] == "to":
        met = float(words[0]) <= value <= float(words[2])
    else:
        met = value >= float(words[1]) if words[0] == ">=" else value <= float(words[1])
    return f"{bar}, {'met' if met else '**missed**'}"


def _contents() -> list[dict[str, Any]]:
    """What was written of every batch, in the order of their seeds."""
    paths = [p for p in RESULTS.glob("effects*.json") if p.stem != "effects-baselines"]  # these are of the first batch
    return sorted((json.loads(p.read_text(encoding="utf-8")) for p in paths), key=lambda content: content["seeds"][0])


def _larger(cases: list[dict[str, Any]]) -> str:
    errors = [c["error"] for c in cases if c.get("verdict") in ("named", "tied")]
    return f"{sum(e['after'] > e['before'] for e in errors)} of {len(errors)}"


def _share(figure: dict[str, Any]) -> str:
    return f"{round(figure['value'] * figure['count'])} of {figure['count']}" if figure["count"] else "–"


if __name__ == "__main__":
    print("\n".join(batches()))
