"""What a camera would have made of a simulated draw: noise, offsets, and points not seen."""

from collections.abc import Collection, Sequence

import numpy as np

from ..core.arrays import FloatArray, IntArray
from ..core.interpolation import interpolate
from ..core.measurement import Recording
from .noise import Noise
from .residuals import Offsets, nearest


class Observer:
    """Gives simulated points the flaws of the measurement, so that an estimator learns to see through them.

    Args:
        recordings: in the order of the point arrays.
        noise: of the measurement.
        offsets: prior standard deviations of clock and position.
        partly: names of recordings that are clouds: what they show of the object, and what is hidden or cut off, is
            told by where their points are, and of a draw only the places nearest to these are seen.
    """

    def __init__(
        self, recordings: Sequence[Recording], noise: Noise, offsets: Offsets, partly: Collection[str] = ()
    ) -> None:
        self.recordings, self.noise, self.offsets, self.partly = list(recordings), noise, offsets, frozenset(partly)

    def observe(
        self, points: Sequence[FloatArray], numbers: IntArray, seed: int, strengths: FloatArray | None = None
    ) -> list[FloatArray]:
        """Flawed copies of ``points``, one array ``(N, T, P, A)`` a recording.

        Args:
            points: clean, as simulated.
            numbers: of the draws ``(N,)``; the flaws of a draw depend on its number and the seed alone.
            seed: of the study.
            strengths: factors of the noise ``(N,)``; left out, one.
        """
        out: list[list[FloatArray]] = [[] for _ in self.recordings]
        for row, number in enumerate(numbers):
            rng = np.random.default_rng([seed, 7919, int(number)])
            strength = 1.0 if strengths is None else float(strengths[row])
            for copies, clean, recording in zip(out, points, self.recordings, strict=True):
                copies.append(self._flawed(np.asarray(clean[row], float), recording, strength, rng))
        return [np.stack(copies) for copies in out]

    def measured(self) -> list[FloatArray]:
        """The real thing, in the same form ``(T, P, A)``."""
        return [r.series.points for r in self.recordings]

    def _flawed(self, clean: FloatArray, recording: Recording, strength: float, rng: np.random.Generator) -> FloatArray:
        time, axes = recording.series.time, clean.shape[-1]
        clock = rng.normal() * self.offsets.clock
        constant = rng.normal(size=axes) * self.offsets.constant
        if clock:
            clean = interpolate(time + clock, time, clean)
        there = clean + constant
        if recording.name in self.partly:
            there = nearest(recording.series.points, there)[0]
        flawed = there + strength * self.noise.sd * self.noise.draw(there, rng)
        if recording.series.correspondence:
            flawed[~np.isfinite(recording.series.points)] = np.nan
        return np.asarray(flawed)
