"""What is right, in figures with intervals."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

#: Of a record, whether a method was right in it.
Test = Callable[["Judged"], bool]
#: From this misfit after calibration on an effect counts as strong [of what is left without it].
STRONG = 3.0
#: Baselines that predict and do not name.
PREDICTORS = ("residual-network",)
#: Half-widths of intervals that hold 90 % and 95 % of a normal distribution [standard deviations].
NINETY, NINETY_FIVE = 1.6449, 1.9600


def wilson(hits: int, count: int, z: float = NINETY_FIVE) -> tuple[float, float]:
    """Interval of a share (Wilson 1927, JASA 22): never outside 0 to 1, and sound for few or for all hits."""
    if count == 0:
        return 0.0, 1.0
    share, square = hits / count, z * z
    middle = (share + square / (2 * count)) / (1 + square / count)
    half = z / (1 + square / count) * np.sqrt(share * (1 - share) / count + square / (4 * count**2))
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


@dataclass(frozen=True)
class Answer:
    """What a method says of one case.

    Args:
        verdict: of a diagnosis; of a method that has names only, ``"named"`` or ``"none"``.
        first: its best guess, whether or not it stands by it.
        effects: the names that it gives.
    """

    verdict: str
    first: str | None
    effects: tuple[str, ...]


@dataclass(frozen=True)
class Judged:
    """A finished case and the answer of one method."""

    record: dict[str, Any]
    answer: Answer

    @property
    def case(self) -> dict[str, Any]:
        found: dict[str, Any] = self.record["case"]
        return found

    @property
    def truth(self) -> dict[str, Any]:
        found: dict[str, Any] = self.record["truth"]
        return found

    @property
    def strong(self) -> bool:
        return min(self.truth["misfit"].values(), default=0.0) >= STRONG


def answer_of(record: dict[str, Any], method: str | None) -> Answer | None:
    """The answer of a baseline, or of the diagnosis itself; None where the method was not asked."""
    if method is None:
        if record.get("failed"):
            return Answer("failed", None, ())
        d = record["diagnosis"]
        effects = tuple(d["effects"])
        candidates = [c["name"] for c in d["candidates"]]
        return Answer(d["verdict"], (*effects, *candidates, None)[0], effects)
    found = record.get("baselines", {}).get(method)
    if found is None or method in PREDICTORS:
        return None
    if found.get("failed"):
        return Answer("failed", None, ())
    name = found["name"]
    return Answer("named" if name else "none", name, (name,) if name else ())


def judged(records: Iterable[dict[str, Any]], method: str | None = None) -> list[Judged]:
    """Every case that a method was asked about; cases that could not be generated are nobody's."""
    pairs = [(r, answer_of(r, method)) for r in records if "left_out" not in r]
    return [Judged(r, a) for r, a in pairs if a is not None]


def top(j: Judged) -> bool:
    """The first guess is right."""
    return j.answer.first in j.truth["accepted"]


def in_set(j: Judged) -> bool:
    """A right name is among those given."""
    return any(e in j.truth["accepted"] for e in j.answer.effects)


def no_name(j: Judged) -> bool:
    return not j.answer.effects


def names(j: Judged) -> bool:
    return not no_name(j)


def says_none(j: Judged) -> bool:
    """That there is a misfit which no candidate explains."""
    return j.answer.verdict == "none"


def tied_right(j: Judged) -> bool:
    """Tied, the truth among them: one name alone would be luck, and no name too little."""
    return j.answer.verdict == "tied" and in_set(j)


def cannot_tell(j: Judged) -> bool:
    return j.answer.verdict == "cannot-tell"


def both(j: Judged) -> bool:
    """Both hidden effects are named, and nothing else."""
    return set(j.answer.effects) == set(j.truth["effects"])


def kind(*kinds: str) -> Test:
    return lambda j: j.case["kind"] in kinds


def source(*sources: str) -> Test:
    return lambda j: j.case["source"] in sources


def thing(name: str, contact: bool | None = None) -> Test:
    """Cases of ropes or of cloth, with or without contact."""

    def test(j: Judged) -> bool:
        setting = j.case["setting"]
        return setting.startswith(name) and contact in (None, setting.endswith("table"))

    return test


def every(*tests: Test) -> Test:
    return lambda j: all(t(j) for t in tests)


OWN_ENGINE = source("same", "finer")
#: One effect of the library, motions that show it, and the model's own engine, be its mesh finer or not.
RICH = every(kind("known"), OWN_ENGINE)
#: The same in the other engine's data.
ELSEWHERE = every(kind("known"), source("other"))


@dataclass(frozen=True)
class Share:
    """A figure that is a share of cases: of those that pass ``among``, how many pass ``right``."""

    name: str
    among: Test
    right: Test
    bar: tuple[str, float] | None = None

    def of(self, cases: Sequence[Judged]) -> tuple[int, int]:
        chosen = [j for j in cases if self.among(j)]
        return sum(self.right(j) for j in chosen), len(chosen)


SHARES = (
    Share("top-1, rope", every(RICH, thing("rope")), top, (">=", 0.98)),
    Share("top-1, cloth with contact", every(RICH, thing("cloth", True)), top, (">=", 0.97)),
    Share("top-1, cloth in the air", every(RICH, thing("cloth", False)), top),
    Share("top-1, weak effects", every(RICH, lambda j: not j.strong), top),
    Share("top-1, strong effects", every(RICH, lambda j: j.strong), top),
    Share("top-1, finer mesh", every(kind("known"), source("finer")), top),
    Share("truth among the names given", RICH, in_set, (">=", 0.98)),
    Share(
        "right where one name is given",
        lambda j: len(j.answer.effects) == 1 and j.case["kind"] not in ("tied", "poor"),
        lambda j: j.answer.effects[0] in j.truth["accepted"],
    ),
    Share("a name where nothing is hidden", every(kind("none"), OWN_ENGINE), names, ("<=", 0.02)),
    Share("'none' where the effect is unknown", kind("unknown"), says_none, (">=", 0.90)),
    Share("a name where the effect is unknown", kind("unknown"), names),
    Share("'tied' where two look alike", kind("tied"), tied_right, (">=", 0.80)),
    Share("'cannot-tell' where the data are poor", kind("poor"), cannot_tell, (">=", 0.80)),
    Share("no name where the data are poor", kind("poor"), no_name),
    Share("other engine: top-1", ELSEWHERE, top, (">=", 0.80)),
    Share("other engine: a name where nothing is hidden", every(kind("none"), source("other")), names, ("<=", 0.05)),
    Share("both of two effects named", kind("two"), both),
    Share("right kind of effect, under another law", kind("law"), in_set),
)


def intervals(cases: Sequence[Judged], where: Test = RICH) -> tuple[list[float], list[bool]]:
    """Of the coefficients of rightly named effects: relative errors, and whether 90 % intervals hold the truth."""
    errors, held = [], []
    for j in cases:
        if not (where(j) and j.answer.effects and top(j)):
            continue
        row = next(c for c in j.record["diagnosis"]["candidates"] if c["name"] == j.answer.effects[0])
        for name, true in j.truth["coefficients"][row["name"]].items():
            found = row["coefficients"][name]
            errors.append(abs(found["mean"] - true) / abs(true))
            held.append(abs(found["mean"] - true) <= NINETY * found["sd"])
    return errors, held


def held_out_over_noise(cases: Sequence[Judged]) -> list[float]:
    """Held-out error after what was named, in units of the true noise; of rich cases."""
    return [
        float(j.record["diagnosis"]["error"]["after"]) / j.case["noise"]
        for j in cases
        if RICH(j) and not j.record.get("failed")
    ]


def held_out_left(cases: Sequence[Judged]) -> list[float]:
    """Held-out error after over before, of the other engine's data with one effect of the library."""
    chosen = [j for j in cases if every(kind("known"), source("other"))(j) and not j.record.get("failed")]
    errors = [j.record["diagnosis"]["error"] for j in chosen]
    return [float(e["after"]) / float(e["before"]) for e in errors]
