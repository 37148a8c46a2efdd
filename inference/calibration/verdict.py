"""What ranks say, in words: calibrated, over-confident, under-confident, biased, misshapen."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri

from ...core.arrays import FloatArray
from .ranks import Ranks

#: The interval that sentences speak of.
LEVEL = 0.8
#: Probability of any complaint about calibrated posteriors, over all tests of one verdict together.
FALSE_ALARMS = 0.05
#: What is found must be worth saying, too: standard deviations off by this factor, means by this many of them.
FACTOR, SHIFT = 1.1, 0.2
#: Fewer cases than this, by weight, tell nothing.
LEAST = 20.0
#: Simulated verdicts behind each probability.
_REPLICATES = 4000
TOGETHER = "all parameters together"


@dataclass(frozen=True)
class Row:
    """One parameter, or all of them together.

    Args:
        name: of it.
        held: share of the cases in which the central 80 % interval (the 80 % highest-density region of all
            together) holds the truth.
        low, high: between which that share lies, with 95 % confidence.
        shift: how far the truth lies above the middle of the posterior, in posterior standard deviations, on average;
            None together.
        factor: by how much the standard deviations must be multiplied; None together.
        finding: ``""``, ``"over-confident"``, ``"under-confident"``, ``"biased"`` or ``"misshapen"``.
    """

    name: str
    held: float
    low: float
    high: float
    shift: float | None
    factor: float | None
    finding: str


@dataclass(frozen=True)
class Verdict:
    """What is wrong with a posterior, if anything.

    Args:
        word: ``"calibrated"``, one of the findings of :class:`Row`, or ``"cannot-tell"``.
        rows: one a parameter, then one for all of them together.
        cases: how many cases of equal weight they rest on.
    """

    word: str
    rows: tuple[Row, ...]
    cases: float

    def sentences(self) -> list[str]:
        """For people: the verdict first."""
        if self.word == "cannot-tell":
            return [f"cannot tell: {self.cases:.0f} cases are too few, at least {LEAST:.0f} are needed"]
        if self.word == "calibrated":
            r = self.rows[-1]
            return [
                f"calibrated, as far as {self.cases:.0f} cases can tell: regions that should hold {LEVEL:.0%} "
                f"hold {r.held:.0%} (95 % confidence: {r.low:.0%} to {r.high:.0%})"
            ]
        return [_sentence(kind, [r for r in self.rows if r.finding == kind]) for kind in self._kinds()]

    def _kinds(self) -> list[str]:
        found = [r.finding for r in self.rows if r.finding]
        return [kind for kind in ("over-confident", "biased", "under-confident", "misshapen") if kind in found]

    def to_json(self) -> dict[str, Any]:
        return {"verdict": self.word, "cases": self.cases, "rows": [vars(r) for r in self.rows]}


def _sentence(kind: str, rows: Sequence[Row]) -> str:
    if kind == "biased":
        told = ", ".join(f"{r.name} (the truth lies {off(r)})" for r in rows)
        return f"biased in {told}"
    if kind == "misshapen":
        return f"misshapen in {', '.join(r.name for r in rows)}: neither too wide nor too narrow, but of another form"
    what = "regions" if rows[0].name == TOGETHER else "intervals"
    holds = ", ".join(f"{r.held:.0%}" + (f" in {r.name}" if len(rows) > 1 else "") for r in rows)
    where = "" if len(rows) > 1 else f" in {rows[0].name}"
    return f"{kind}{where}: {what} that should hold {LEVEL:.0%} hold {holds}"


def off(row: Row) -> str:
    """How far the truth lies from the middle of the posterior, in words."""
    shift = row.shift or 0.0
    return f"{abs(shift):.2g} sd {'above' if shift > 0 else 'below'} the middle"


def judge(ranks: Ranks, names: Sequence[str], rng: np.random.Generator, false_alarms: float = FALSE_ALARMS) -> Verdict:
    """The verdict on ranks.

    Of each parameter, the ranks as normal scores have mean 0 and standard deviation 1 if all is well; the mean tells a
    bias, the standard deviation about that mean too narrow or too wide a posterior, and the largest distance of
    their distribution from the uniform one (Kolmogorov) everything else. Of all parameters together, the same of
    the highest-density regions and of TARP; that is said where no parameter by itself shows anything. The
    distribution of each figure without a fault is simulated with the weights at hand. A complaint needs that the
    figure is improbable (Bonferroni over all tests) and that it is worth a word (:data:`FACTOR`, :data:`SHIFT`).

    Args:
        ranks: of all cases.
        names: of the parameters.
        rng: of the simulated figures.
        false_alarms: probability of any complaint about calibrated posteriors.
    """
    if ranks.effective < LEAST:
        return Verdict("cannot-tell", (), ranks.effective)
    w = ranks.weights / ranks.weights.sum()
    each = _figures(rng.random((_REPLICATES, len(w))), w)
    level = false_alarms / (3 * len(names) + 3)

    def improbable(k: int, value: float, two_sided: bool = True) -> bool:
        above, below = float(np.mean(each[k] >= value)), float(np.mean(each[k] <= value))
        return min(above, below) * 2 < level if two_sided else above < level

    rows = []
    for k, name in enumerate(names):
        column = ranks.parameter[:, k]
        shift, factor, distance = (float(f[0]) for f in _figures(column[None], w))
        finding = ""
        if improbable(1, factor) and not 1 / FACTOR < factor < FACTOR:
            finding = "over-confident" if factor > 1 else "under-confident"
        elif improbable(0, shift) and abs(shift) > SHIFT:
            finding = "biased"
        elif improbable(2, distance, two_sided=False) and 1 / FACTOR < factor < FACTOR and abs(shift) < SHIFT:
            finding = "misshapen"
        held = float(w @ (np.abs(column - 0.5) < LEVEL / 2))
        rows.append(Row(name, held, *_interval(held, ranks.effective), shift, factor, finding))
    rows.append(_together(ranks, w, any(r.finding for r in rows), improbable))
    kinds = [r.finding for r in rows if r.finding]
    order = ("over-confident", "biased", "under-confident", "misshapen")
    return Verdict(min(kinds, key=order.index) if kinds else "calibrated", tuple(rows), ranks.effective)


def _together(ranks: Ranks, w: FloatArray, explained: bool, improbable: Callable[..., bool]) -> Row:
    held = float(w @ (ranks.region < LEVEL))
    low, high = _interval(held, ranks.effective)
    mean, _, distance = (float(f[0]) for f in _figures(ranks.region[None], w))
    tarp = float(_figures(ranks.tarp[None], w)[2][0])
    finding = ""
    if not explained:
        if improbable(0, mean) and abs(mean) > SHIFT:
            finding = "over-confident" if mean > 0 else "under-confident"
        elif improbable(2, distance, two_sided=False) or improbable(2, tarp, two_sided=False):
            finding = "misshapen"
    return Row(TOGETHER, held, low, high, None, None, finding)


def _figures(ranks: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of each row of ranks ``(R, N)``: mean and standard deviation of the normal scores, distance from uniform ones."""
    score = ndtri(np.clip(ranks, 1e-9, 1 - 1e-9))
    mean = score @ w
    order = np.argsort(ranks, axis=1)
    place, after = np.take_along_axis(ranks, order, axis=1), np.cumsum(w[order], axis=1)
    distance = np.maximum((after - place).max(axis=1), (place - after + w[order]).max(axis=1))
    return mean, np.sqrt((score - mean[:, None]) ** 2 @ w), distance


def _interval(share: float, cases: float) -> tuple[float, float]:
    """Wilson's 95 % interval of a share."""
    z2 = 1.96**2
    middle = (share + z2 / (2 * cases)) / (1 + z2 / cases)
    half = np.sqrt(z2 * (share * (1 - share) / cases + z2 / (4 * cases**2))) / (1 + z2 / cases)
    return float(max(middle - half, 0.0)), float(min(middle + half, 1.0))
