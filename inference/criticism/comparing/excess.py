"""Which recordings, phases and parts carry the squared error that noise does not explain."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....core.arrays import FloatArray
from ...noise import Noise
from .groups import Partition
from .held import Held
from .replicates import NoiseDraws
from .sayings import fraction, where

#: No shares are told of an excess below this part of what noise gives, or below so many standard deviations of that.
_LEAST_EXCESS, _SURE = 0.05, 3.0
#: A group is named for a share of at least this, if it is also this many times its share of the numbers.
_NOTABLE, _CONCENTRATED = 0.4, 1.25
#: Replicates that tell how large differences are under noise alone.
_REPLICATES = 40


@dataclass(frozen=True)
class Group:
    """Numbers that belong together. Errors are root mean squares over coordinates [unit].

    Args:
        partition, name, note: what they have in common.
        portion: of all compared numbers.
        rmse: of the best fit.
        expected: what noise alone gives.
        scatter: of the predictions of posterior draws.
        share: of the whole squared error above the noise, negative where it is below; None if there is no such excess.
    """

    partition: str
    name: str
    note: str
    portion: float
    rmse: float
    expected: float
    scatter: float
    share: float | None


def excess(
    takes: Sequence[Held], sorted_by: Sequence[Partition], noise: Noise, rng: np.random.Generator
) -> list[Group]:
    """Every group of every partition, over all recordings."""
    square = [np.where(h.seen, h.residual.difference, 0.0) ** 2 for h in takes]
    expected = [_expected(h, noise, rng) * h.seen for h in takes]
    scatter = [_scatter(h) for h in takes]
    count, total = sum(int(h.seen.sum()) for h in takes), sum(float(s.sum()) for s in square)
    above = total - sum(float(e.sum()) for e in expected)
    chance = np.sqrt(2 / (noise.information * count) + (2 * noise.relative_error) ** 2)
    placed = above > max(_LEAST_EXCESS, _SURE * chance) * (total - above)
    out = []
    for p in sorted_by:
        for k, name in enumerate(p.names):
            inside = [(x == k)[..., None] & h.seen for x, h in zip(p.labels, takes, strict=True)]
            n = sum(int(i.sum()) for i in inside)
            if not n:
                continue
            sums = [sum(float(a[i].sum()) for a, i in zip(x, inside, strict=True)) for x in (square, expected, scatter)]
            share = (sums[0] - sums[1]) / above if placed else None
            root = [float(np.sqrt(s / n)) for s in sums]
            out.append(Group(p.title, name, p.notes[k], n / count, root[0], root[1], root[2], share))
    return out


def sentence(groups: Sequence[Group], recordings: int) -> str:
    """Where the excess is, in one sentence."""
    if all(g.share is None for g in groups):
        return "As a whole the error is no larger than the noise may make it."
    told: list[str] = []
    for partition in ("recording", "phase", "contact", "distance", "place"):
        of = [g for g in groups if g.partition == partition and g.share is not None]
        best = max(of, key=lambda g: g.share or 0.0, default=None)
        if best is None or best.share is None or (partition == "recording" and recordings < 3):
            continue
        if best.share >= _NOTABLE and best.share >= _CONCENTRATED * best.portion:
            place = f"in recording {best.name}" if partition == "recording" else where(best.name)
            numbers = "" if told else " of the numbers"
            told.append(f"{fraction(best.share)} {'arises ' * (not told)}{place} ({100 * best.portion:.0f} %{numbers})")
    if not told:
        return "The error above the noise is spread evenly over phases and parts."
    listed = told[0] if len(told) == 1 else f"{', '.join(told[:-1])} and {told[-1]}"
    return f"Of the squared error above the noise, {listed}."


def _expected(held: Held, noise: Noise, rng: np.random.Generator) -> float:
    """Mean square of a number under noise alone [unit2]."""
    if held.paired:
        return noise.sd**2
    draws = NoiseDraws(noise, _REPLICATES, rng).at(held.origin, rng) * noise.sd
    under = held.under_noise(draws)[:, held.seen]
    return float(np.mean(under**2))


def _scatter(held: Held) -> FloatArray:
    """Variance of predictions over posterior draws, at every measured number ``(T, P, A)`` [unit2]."""
    if len(held.draws) < 2:
        return np.zeros(held.seen.shape)
    variance = np.var(held.draws, axis=0)
    return np.asarray(np.take_along_axis(variance, held.partner[..., None], axis=1))
