"""Neural posterior estimation for small budgets: several readings of the points, flows and mixtures, stacked."""

from collections.abc import Mapping
from typing import Any, ClassVar

import torch

from ...core.arrays import FloatArray
from ...core.errors import InputError, StepMissingError
from ..density.coordinates import NAMES as COORDINATES
from ..density.device import device_of
from ..density.draws import Draws
from ..density.reading import Reading
from ..density.stacked import Shape, StackedDensity
from .base import Answer, TrainedEstimator
from .npe_settings import PRESETS, Settings

_HEADS = ("mixture", "flow")


class NPERKHS(TrainedEstimator):
    """q(theta | x): RKHS embedding with a time model, and flows beside mixtures on the errors of a linear density.

    - Read are (:class:`~..density.reading.Reading`) the coordinates of corresponding points, the moments of every
      frame's set, what time models on learned kernel mean embeddings of the frames predict, and components of those
      embeddings; columns that go with no parameter beyond chance are left out.
    - A sparse linear regression makes a first guess, and coordinates about it in which the bounds of the prior are
      those of a normal that is cut off, or ones in which the prior is Gaussian, whichever suits
      (:class:`~..density.coordinates.Coordinates`). Where the posterior is linear and Gaussian, that is all there is
      to learn.
    - Ensembles of mixture density networks and of neural spline flows learn what is left over, each member stopped
      early on draws that it leaves out, and from which nothing that it reads was made; stacking on those draws weighs
      them, the linear and the flat density (:class:`~..density.stacked.StackedDensity`).

    The posterior's support and normalisation are exact. Training takes seconds for a thousand draws. A measurement
    outside the range of the draws is pulled to its border: check a posterior against the measurement before
    trusting it.

    Args:
        correspondence: whether point p is the same spot of the object in every frame and draw: one flag, or one a
            recording. Without it, the order of the points has no influence, to the last bit.
        preset: ``"default"`` or ``"paper"``.
        options: any field of :class:`~.npe_settings.Settings`, put over the preset.

    Raises:
        InputError: an unknown preset or option, a value out of range, or a device that is not there.
    """

    name: ClassVar[str] = "npe-rkhs"

    presets: ClassVar[Mapping[str, Any]] = PRESETS
    may_be_zero: ClassVar[tuple[str, ...]] = ("weight_decay", "frames", "points", "time_epochs")

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._heads = tuple(self.settings.heads.split("+"))
        if not set(self._heads) <= set(_HEADS):
            raise InputError(f"npe-rkhs: heads must be of {' and '.join(_HEADS)}, not {self.settings.heads!r}")
        if self.settings.coordinates not in ("auto", *COORDINATES):
            named = ", ".join(("auto", *COORDINATES))
            raise InputError(f"npe-rkhs: coordinates must be one of {named}, not {self.settings.coordinates!r}")
        self._device = device_of(self.settings.device)
        self._weights: dict[str, float] = {}

    def _train(self, x: list[FloatArray], flags: tuple[bool, ...], draws: Draws, generator: torch.Generator) -> Answer:
        s: Settings = self.settings
        plan = s.time_plan if s.time_epochs else None
        reading = Reading(x, flags, draws, plan, s.principal, generator, self._device)
        shape = Shape(
            self._heads, s.members, s.held_out, s.coordinates, s.components, s.hidden, s.transforms, s.bins,
            s.principal, s.shown,
        )  # fmt: skip
        schedule = s.schedule(len(draws.unit))
        density = StackedDensity(reading.training, draws, shape, schedule, generator, self._device)
        self._weights = density.weights
        return lambda batch: density.posterior(reading(batch))

    @property
    def weights(self) -> dict[str, float]:
        """How much each kind of density counts, by name.

        Raises:
            StepMissingError: before :meth:`fit`.
        """
        if self._answer is None:
            raise StepMissingError("npe-rkhs has no weights before fit")
        return dict(self._weights)
