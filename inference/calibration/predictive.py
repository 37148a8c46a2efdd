"""Posterior predictive checks: could the measurement be one of what the posterior predicts?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.arrays import FloatArray
from ...core.measurement import Recording
from ...core.series import PointSeries
from ..noise import Noise
from ..observe import Observer
from ..residuals import Offsets, residual

#: Noisy copies of predictions, at least.
REPLICATES = 200
#: A recording is called unlike the predictions below this probability, or above one minus it.
SIGNIFICANCE = 0.01


@dataclass(frozen=True)
class Predictive:
    """One recording.

    Args:
        recording, role: its name, and ``"fit"`` or ``"held-out"``.
        measured: how far the measurement lies from the mean prediction, root mean square in standard deviations of
            prediction and noise together.
        low, high: between which 95 % of the replicates lie, in the same way.
        p_value: share of the replicates that lie at least as far off.
        draws: predictions that could be simulated.
    """

    recording: str
    role: str
    measured: float
    low: float
    high: float
    p_value: float
    draws: int

    @property
    def finding(self) -> str:
        """``"unlike"``, ``"too-wide"`` or ``""``."""
        if self.p_value < SIGNIFICANCE:
            return "unlike"
        return "too-wide" if self.p_value > 1 - SIGNIFICANCE else ""

    def text(self) -> str:
        """One line for people."""
        what = {
            "": "like what the posterior predicts",
            "unlike": "unlike all that the posterior predicts: the model lacks something, or the posterior is wrong",
            "too-wide": "nearer to the mean prediction than expected: the posterior is too wide or the noise too large",
        }[self.finding]
        return (
            f"{self.recording} ({self.role}): {self.measured:.2f} sd from the mean prediction, replicates "
            f"{self.low:.2f} to {self.high:.2f}, p = {self.p_value:.2g}: {what}"
        )


def predictive_check(
    recording: Recording,
    role: str,
    predictions: Sequence[FloatArray],
    noise: Noise,
    offsets: Offsets,
    rng: np.random.Generator,
    partly: bool = False,
) -> tuple[Predictive, FloatArray]:
    """Hold a measurement against predictions of posterior draws.

    A replicate is a prediction with the flaws of the measurement: noise, offsets, points not seen. Its discrepancy is
    taken from the mean of the *other* predictions, the measurement's from the mean of all; clock and constant offset
    are taken out of either in the same way. The discrepancy does not depend on the parameters of the draw (unlike
    Gelman, Meng & Stern 1996): a posterior learned from few simulations is wider than the exact one, and its draws
    miss the measurement by more than the noise although nothing is wrong.

    Args:
        recording: the measurement.
        role: ``"fit"`` or ``"held-out"``.
        predictions: clean points ``(T, P, A)`` of posterior draws, at least three.
        noise, offsets: of the measurement.
        rng: of the replicates.
        partly: the recording is a cloud that shows a part of the object, see :class:`~..observe.Observer`.

    Returns:
        The finding, and the discrepancies of the replicates ``(R,)``.
    """
    clean = np.stack(predictions)
    spread = np.sqrt(clean.var(axis=0, ddof=1) * (1 + 1 / len(clean)) + noise.sd**2)
    total, observer = clean.sum(axis=0), Observer([recording], noise, offsets, [recording.name] if partly else ())
    copies = np.repeat(clean, -(-REPLICATES // len(clean)), axis=0)
    numbers, start = np.arange(len(copies)), int(rng.integers(2**31))
    # the noise may be larger or smaller than it is taken for, by the error of its estimate
    strengths = 1.0 + noise.relative_error * rng.standard_normal(len(copies))
    replicates = []
    for k, flawed in enumerate(observer.observe([copies], numbers, start, strengths)[0]):
        others = (total - copies[k]) / (len(clean) - 1)
        replicates.append(_discrepancy(recording, flawed, others, spread, noise, offsets))
    measured = _discrepancy(recording, recording.series.points, total / len(clean), spread, noise, offsets)
    each = np.array(replicates)
    p = float((1 + np.sum(each >= measured)) / (1 + len(each)))
    low, high = np.quantile(each, [0.025, 0.975])
    return Predictive(recording.name, role, measured, float(low), float(high), p, len(clean)), each


def _discrepancy(
    recording: Recording, points: FloatArray, mean: FloatArray, spread: FloatArray, noise: Noise, offsets: Offsets
) -> float:
    series = recording.series
    seen = replace(recording, series=PointSeries(series.time, points, series.unit, series.correspondence))
    model = PointSeries(series.time, mean, series.unit, series.correspondence)
    difference = residual(seen, model, noise, offsets).difference
    # Points that do not correspond have no spread of their own: each is held against its nearest one.
    scale = spread if series.correspondence else float(np.sqrt(np.mean(spread**2)))
    return float(np.sqrt(np.nanmean((difference / scale) ** 2)))
