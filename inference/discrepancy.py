"""How a right model may still be off: directions that a smaller step or another engine would change, and chance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias

import numpy as np

from ..core.arrays import FloatArray

#: Steps of one-sided differences in the unit cube: the least that rounding allows, and the most that is still local.
LEAST_STEP, MOST_STEP = 1e-4, 2e-3
#: Residuals with more chance than this are left out [noise variances].
MOST_CHANCE = 1.0


#: Left singular vectors ``(N_r, K)`` and singular values ``(K,)``.
Factors: TypeAlias = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """Error of the model beside the noise: residuals are ``D a + chance + noise`` with ``a ~ N(0, I)``.

    White residuals then have the covariance ``I + V + D D'``. Whitening by it takes off what lies along the directions,
    as far as their amplitudes are free to explain it, weighs down what chance decides, and leaves everything else as it
    is (model discrepancy as a nuisance: Kennedy and O'Hagan 2001, told by computer experiments). Where chance is more
    than the noise, residuals become zero and count no more: derivatives are of chance, too, there.

    Args:
        directions: ``D``, ``(N_r, K)`` a recording, in units of the noise; recordings without any may be missing.
        chance: diagonal of ``V``, ``(N_r,)`` a recording [noise variances]; the same.
        step: at which derivatives of residuals are told, between chance and curvature.
    """

    directions: Mapping[str, FloatArray] = field(default_factory=dict)
    chance: Mapping[str, FloatArray] = field(default_factory=dict)
    step: float = MOST_STEP

    @cached_property
    def _factors(self) -> dict[str, Factors]:
        return {name: self._factored(name, d) for name, d in self.directions.items()}

    def _factored(self, recording: str, directions: FloatArray) -> Factors:
        """Left singular vectors and singular values of what is scaled by chance already."""
        scaled = directions * self._scale(recording, directions[:, 0])[:, None]
        u, s, _ = np.linalg.svd(scaled, full_matrices=False)
        return u, s

    def _scale(self, recording: str, like: FloatArray) -> FloatArray:
        v = self.chance.get(recording, np.zeros_like(like))
        return np.asarray(np.where(v > MOST_CHANCE, 0.0, 1.0 / np.sqrt(1.0 + v)))

    def dropped(self, recordings: Sequence[str]) -> int:
        """How many of the residuals of ``recordings`` do not count."""
        return int(sum(np.sum(self.chance[name] > MOST_CHANCE) for name in recordings if name in self.chance))

    def nothing_counts(self, recordings: Sequence[str]) -> bool:
        """Is every residual of ``recordings`` dropped?"""
        return all(name in self.chance and bool((self.chance[name] > MOST_CHANCE).all()) for name in recordings)

    def left_to_chance(self, recordings: Sequence[str]) -> float:
        """How many of those that count are chance's rather than noise's."""
        seen = [self.chance[name] for name in recordings if name in self.chance]
        return float(sum(np.sum(np.where(v > MOST_CHANCE, 0.0, v / (1.0 + v))) for v in seen))

    def whitened(self, recording: str, white: FloatArray) -> FloatArray:
        """``(I + V + D D')^-1/2`` times white residuals ``(N_r,)``, scaled by chance first."""
        if recording in self.chance:
            white = white * self._scale(recording, white)
        if recording not in self.directions:
            return white
        u, s = self._factors[recording]
        return np.asarray(white + u @ ((1.0 / np.sqrt(1.0 + s**2) - 1.0) * (u.T @ white)))


NONE = Discrepancy()
