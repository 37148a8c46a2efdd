"""What estimators share: options, checks of what they are given, a seeded fit, one posterior a measurement."""

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import torch

from ...core.arrays import FloatArray
from ...core.errors import StepMissingError
from ...core.estimator import Posterior, PosteriorEstimator
from ..density.draws import Draws
from ..density.training import isolated
from .inputs import checked, flags_of, measured
from .options import with_options

#: Recordings of one measurement, each ``(1, T_r, P, A)``, to its posterior.
Answer = Callable[[list[FloatArray]], Posterior]


class TrainedEstimator(PosteriorEstimator):
    """An estimator that is trained once on all draws and then answers measurement by measurement.

    Args:
        correspondence: whether point p is the same spot of the object in every frame and draw: one flag, or one a
            recording.
        preset: ``"default"`` or ``"paper"``.
        options: any field of the estimator's settings, put over the preset.

    Raises:
        InputError: an unknown preset or option, or a value out of range.
    """

    presets: ClassVar[Mapping[str, Any]]
    may_be_zero: ClassVar[tuple[str, ...]] = ("patience",)

    def __init__(
        self, *, correspondence: bool | Sequence[bool] = True, preset: str = "default", **options: Any
    ) -> None:
        self.correspondence = correspondence
        self.settings = with_options(self.name, self.presets, preset, options, self.may_be_zero)
        self._answer: Answer | None = None

    @abstractmethod
    def _train(self, x: list[FloatArray], flags: tuple[bool, ...], draws: Draws, generator: torch.Generator) -> Answer:
        """Train on checked draws; all randomness comes from ``generator`` and from torch's, which is seeded."""

    def fit(
        self, theta: FloatArray, x: list[FloatArray], *, log_weights: FloatArray | None = None, seed: int = 0
    ) -> None:
        """Train, replacing whatever was trained before.

        Args:
            theta: ``(N, D)`` in the unit cube.
            x: ``(N, T_r, P, A)`` a recording; NaN = not seen.
            log_weights: ``(N,)``; see :func:`~..density.training.importance_weights` for how they are used. Draws of
                weight zero are left out.
            seed: of everything random; the same draws and seed give the same posterior to the bit.

        Raises:
            InputError: fewer than 10 draws, shapes that do not fit, parameters outside the unit cube, draws in
                which nothing was seen, or weights that make no sense.
        """
        theta, x, weights = checked(theta, x, log_weights)
        flags = flags_of(self.correspondence, len(x))
        self._answer = None
        with isolated(seed, self.settings.threads) as generator:
            self._answer = self._train(x, flags, Draws.of(theta, weights), generator)

    def posterior(self, x: list[FloatArray]) -> Posterior:
        """The posterior given one measurement.

        Raises:
            StepMissingError: before :meth:`fit`.
            InputError: recordings that do not fit those trained on, or nothing seen in one of them.
        """
        if self._answer is None:
            raise StepMissingError(f"{self.name} has no posterior before fit")
        batch = measured(x)
        with isolated(0, self.settings.threads), torch.no_grad():
            return self._answer(batch)
