"""One p value that the model is adequate, by simulation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....core.arrays import FloatArray
from ...noise import Noise
from ...residuals import Offsets
from .groups import Partition
from .held import Held
from .replicates import NoiseDraws, Refit
from .statistics import Statistic, all_statistics

#: A model is called adequate unless a misfit this large is less probable than that under the noise.
SIGNIFICANCE = 0.01
#: Replicates, fewer of long measurements; their numbers in all; and how many are worked on at a time, in numbers.
_MOST, _FEWEST, _NUMBERS, _CHUNK = 2000, 400, 30_000_000, 2_000_000


@dataclass(frozen=True)
class Sign:
    """One statistic of the fitted recordings.

    Args:
        name: what it sees, in words.
        value: mean square of what it averages, in units of what white noise would give.
        expected: the same of replicates.
        z: how far it is above them, in their standard deviations after a transform that makes them nearly normal.
    """

    name: str
    value: float
    expected: float
    z: float


@dataclass(frozen=True)
class Adequacy:
    """Is the misfit of the fitted recordings more than noise?

    Args:
        p_value: probability that the largest of all signs is at least this large if model and noise are right.
        replicates: that it was found with; it cannot be below one over this.
        signs: statistics, the largest z first.
        limit: the z that the largest sign exceeds in one of twenty cases under noise alone.
    """

    p_value: float
    replicates: int
    signs: tuple[Sign, ...]
    limit: float

    @property
    def adequate(self) -> bool:
        return self.p_value > SIGNIFICANCE

    def text(self) -> str:
        """A sentence."""
        least = self.p_value <= 1 / (self.replicates + 1) + 1e-12
        p = f"p < {1 / self.replicates:.2g}" if least else f"p = {self.p_value:.2g}"
        if self.adequate:
            return (
                "The model is adequate on the recordings that it was fitted to: the misfit is no larger than the noise "
                f"explains ({p})."
            )
        return f"The model is not adequate ({p}); what gives it away most: {self.signs[0].name}."


def adequacy(
    takes: Sequence[Held],
    sorted_by: Sequence[Partition],
    jacobian: FloatArray,
    unit: FloatArray,
    noise: Noise,
    offsets: Offsets,
    rng: np.random.Generator,
) -> Adequacy:
    """Hold the residuals of a fit against those of refits to replicates: best prediction plus noise.

    Many statistics are computed, of the size of residuals and of their coherence in time and space, each is
    standardised by its replicates, and the largest is compared with the largest of every replicate; so it is one test,
    whatever the number of statistics. Residuals and replicates go through the same linear refit, so that neither
    parameters nor offsets that were fitted make the p value too large (as they do in posterior predictive checks that
    compare unfitted replicates: Robins, van der Vaart and Ventura, JASA 95, 2000).

    Args:
        takes: the fitted recordings, in the order of the rows of ``jacobian``.
        sorted_by: partitions of these recordings.
        jacobian: derivative of their white residuals ``(N, D)`` by the parameters in the unit cube.
        unit: the best fit in it ``(D,)``.
        noise, offsets: of the measurement.
        rng: source of the replicates.
    """
    statistics = all_statistics(takes, sorted_by)
    refit = Refit(jacobian, unit, np.vstack(_block_columns(takes, noise, offsets)))
    count = int(np.clip(_NUMBERS / len(jacobian), _FEWEST, _MOST))
    draws, step = NoiseDraws(noise, count, rng), max(1, _CHUNK // len(jacobian))
    per = [slice(k, min(k + step, count)) for k in range(0, count, step)]
    null = np.concatenate(
        [_values(takes, statistics, refit(_rows(takes, draws, s, noise, offsets, rng)), noise) for s in per]
    )
    white = np.concatenate([h.residual.white for h in takes])
    own = _values(takes, statistics, refit(white[None]), noise)[0]
    # sums of squares are nearly normal after a cube root (Wilson and Hilferty 1931)
    root, mean = np.cbrt(null), np.cbrt(null).mean(axis=0)
    spread = np.maximum(root.std(axis=0), 1e-12)
    z, largest = (np.cbrt(own) - mean) / spread, ((root - mean) / spread).max(axis=1)
    p = float((1 + np.sum(largest >= z.max())) / (count + 1))
    expected = null.mean(axis=0)
    signs = [Sign(s.name, float(own[k]), float(expected[k]), float(z[k])) for k, s in enumerate(statistics)]
    return Adequacy(p, count, tuple(sorted(signs, key=lambda s: -s.z)), float(np.quantile(largest, 0.95)))


def _values(takes: Sequence[Held], statistics: Sequence[Statistic], rows: FloatArray, noise: Noise) -> FloatArray:
    """Statistics ``(R, S)`` of white residuals ``(R, N)``, rows for the priors of offsets among them."""
    parts, at = [], 0
    for held in takes:
        seen = int(held.seen.sum())
        parts.append(rows[:, at : at + seen])
        at += len(held.residual.white)
    residuals = np.ascontiguousarray(np.concatenate(parts, axis=1).T) / np.sqrt(noise.information)
    return np.stack([s.of(residuals) for s in statistics], axis=1)


def _rows(
    takes: Sequence[Held], draws: NoiseDraws, which: slice, noise: Noise, offsets: Offsets, rng: np.random.Generator
) -> FloatArray:
    """White residuals of replicates before their refit ``(R, N)``; each has offsets of its own, from the prior."""
    parts = []
    for held in takes:
        under = held.under_noise(draws.at(held.origin, rng, which) * noise.sd)
        weight = np.sqrt(noise.information) / noise.sd
        parts.append(under[:, held.seen] * weight)
        extra = len(held.residual.white) - parts[-1].shape[1]
        parts.append(rng.normal(size=(len(under), extra)))
    return np.concatenate(parts, axis=1)


def _block_columns(takes: Sequence[Held], noise: Noise, offsets: Offsets) -> list[FloatArray]:
    """Derivatives of the white residuals by each recording's own offsets, one recording after the other."""
    blocks = [_offset_columns(h, noise, offsets) for h in takes]
    total, out, at = sum(b.shape[1] for b in blocks), [], 0
    for block in blocks:
        wide = np.zeros((len(block), total))
        wide[:, at : at + block.shape[1]] = block
        at += block.shape[1]
        out.append(wide)
    return out


def _offset_columns(held: Held, noise: Noise, offsets: Offsets) -> FloatArray:
    axes, weight = held.seen.shape[2], np.sqrt(noise.information) / noise.sd
    columns, own = [], []
    if offsets.clock > 0:
        model = held.recording.series.points - held.residual.difference
        slope = np.nan_to_num(np.gradient(model, held.recording.series.time, axis=0))
        columns.append(-slope[held.seen] * weight)
        own.append(1 / offsets.clock)
    if offsets.constant > 0:
        for a in range(axes):
            columns.append(np.where(np.arange(axes) == a, -weight, 0.0 * held.residual.difference)[held.seen])
            own.append(1 / offsets.constant)
    rows = np.stack(columns, axis=1) if columns else np.zeros((int(held.seen.sum()), 0))
    return np.vstack([rows, np.diag(own) if own else np.zeros((0, 0))])
