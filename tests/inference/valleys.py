"""A least-squares problem of many recordings with two valleys, one of which is better on some of them only."""

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective
from muslin.inference.residuals import Offsets
from muslin.inference.subset import some_of

NAMES = [str(k) for k in range(20)]
SEARCHED = some_of(NAMES)
SHARP = 100.0
#: Numbers that a recording shows.
SEEN = 5


class Valleys(Objective):
    """Two valleys: every recording leaves what noise does at 0.8, and at 0.2 a misfit, which ``elsewhere`` may lessen.

    Args:
        elsewhere: what is left at 0.2 of recordings that are not searched on [noise standard deviations].
        recordings: names.
    """

    def __init__(self, elsewhere: float, recordings: list[str]) -> None:
        space = ParameterSpace((Parameter("a", "1", 0, 1),))
        noise = Noise(1.0, 0.0, "test", "m", 0.01)
        super().__init__(None, space, recordings, noise, Offsets(), smooth=True)  # type: ignore[arg-type]
        self.elsewhere, self.evaluations = elsewhere, 0

    def on(self, recordings: list[str]) -> "Valleys":  # type: ignore[override]
        return Valleys(self.elsewhere, recordings)

    def rows(self, recordings: list[str]) -> FloatArray:  # type: ignore[override]
        return np.repeat([name in recordings for name in self.recordings], SEEN)

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        self.evaluations += len(units)
        return [np.concatenate([self.left(name, u[0]) for name in self.recordings]) for u in units]

    def left(self, name: str, unit: float) -> FloatArray:
        near, least = (0.8, 1.0 if name in SEARCHED else self.elsewhere) if unit > 0.5 else (0.2, 2.0)
        return np.append(np.full(SEEN - 1, least), SHARP * (unit - near))
