"""What a camera would have made of a simulated draw: noise, offsets, and points not seen."""

from collections.abc import Sequence

import numpy as np

from ..core.arrays import FloatArray, IntArray
from ..core.interpolation import interpolate
from ..core.measurement import Recording
from .noise import Noise, ar1_noise
from .residuals import Offsets


class Observer:
    """Gives simulated points the flaws of the measurement, so that an estimator learns to see through them.

    Args:
        recordings: in the order of the point arrays.
        noise: of the measurement.
        offsets: prior standard deviations of clock and position.
    """

    def __init__(self, recordings: Sequence[Recording], noise: Noise, offsets: Offsets) -> None:
        self.recordings, self.noise, self.offsets = list(recordings), noise, offsets

    def observe(self, points: Sequence[FloatArray], numbers: IntArray, seed: int) -> list[FloatArray]:
        """Flawed copies of ``points``, one array ``(N, T, P, A)`` a recording.

        Args:
            points: clean, as simulated.
            numbers: of the draws ``(N,)``; the flaws of a draw depend on its number and the seed alone.
            seed: of the study.
        """
        out = [np.array(p, float) for p in points]
        for row, number in enumerate(numbers):
            rng = np.random.default_rng([seed, 7919, int(number)])
            for r, recording in enumerate(self.recordings):
                out[r][row] = self._flawed(out[r][row], recording, rng)
        return out

    def measured(self) -> list[FloatArray]:
        """The real thing, in the same form ``(T, P, A)``."""
        return [r.series.points for r in self.recordings]

    def _flawed(self, clean: FloatArray, recording: Recording, rng: np.random.Generator) -> FloatArray:
        time, axes = recording.series.time, clean.shape[-1]
        clock = rng.normal() * self.offsets.clock
        constant = rng.normal(size=axes) * self.offsets.constant
        if clock:
            clean = interpolate(time + clock, time, clean)
        flawed = clean + constant + self.noise.sd * ar1_noise(clean.shape, self.noise.ar1, rng)
        if recording.series.correspondence:
            flawed[~np.isfinite(recording.series.points)] = np.nan
        return np.asarray(flawed)
