"""Print what every recorded batch of hidden effects came to: one row each, of what ``effects.py`` wrote.

A batch has seeds of its own, which nothing was improved on before it ended; what was learned from one is in the code
of the next. ::

    python tests/benchmarks/effects_batches.py
"""

import json
from pathlib import Path
from typing import Any

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

LARGER = "names that make the held-out error larger"


def batches() -> list[str]:
    """The table as lines of Markdown."""
    heads = ["first seed", "commit", "cases", *COLUMNS.values(), LARGER]
    lines = [row(heads), "|---" * len(heads) + "|"]
    for path in sorted(RESULTS.glob("effects*.json"), key=_first_seed):
        content = json.loads(path.read_text(encoding="utf-8"))
        if path.stem == "effects-baselines":
            continue  # what other methods make of cases of the first batch
        found = {f["name"]: f for f in content["figures"]}
        ended = sum("verdict" in c for c in content["cases"])
        shares = [_share(found[name]) for name in COLUMNS]
        lines.append(row([str(content["seeds"][0]), content["commit"], str(ended), *shares, _larger(content["cases"])]))
    return lines


def _larger(cases: list[dict[str, Any]]) -> str:
    errors = [c["error"] for c in cases if c.get("verdict") in ("named", "tied")]
    return f"{sum(e['after'] > e['before'] for e in errors)} of {len(errors)}"


def _first_seed(path: Path) -> int:
    return int(json.loads(path.read_text(encoding="utf-8"))["seeds"][0])


def _share(figure: dict[str, Any]) -> str:
    return f"{round(figure['value'] * figure['count'])} of {figure['count']}" if figure["count"] else "–"


if __name__ == "__main__":
    print("\n".join(batches()))
