"""Neural posterior estimation for small budgets: several readings of the points, flows and mixtures, stacked."""

from collections.abc import Sequence
from typing import Any, ClassVar

import torch

from ...core.arrays import FloatArray
from ...core.errors import InputError, StepMissingError
from ...core.estimator import PosteriorEstimator
from ..density.coordinates import NAMES as COORDINATES
from ..density.device import device_of
from ..density.draws import Draws
from ..density.reading import Reading
from ..density.stacked import Shape, StackedDensity
from ..density.training import isolated
from ..posterior.flow import FlowPosterior
from .inputs import checked, flags_of, measured
from .npe_settings import PRESETS, Settings
from .options import with_options

_HEADS = ("mixture", "flow")


class NPERKHS(PosteriorEstimator):
    """q(theta | x): RKHS embedding with a time model, and flows beside mixtures on the errors of a linear density.

    - Read are (:class:`~..density.reading.Reading`) the coordinates of corresponding points, the moments of every
      frame's set, what time models on learned kernel mean embeddings of the frames predict, and components of those
      embeddings; columns that go with no parameter beyond chance are left out.
    - A sparse linear regression makes a first guess, and coordinates about it in which the bounds of the prior are
      those of a normal that is cut off, or ones in which the prior is Gaussian, whichever suits
      (:class:`~..density.coordinates.Coordinates`). Where the posterior is linear and Gaussian, that is all there is
      to learn.
    - Ensembles of mixture density networks and of neural spline flows learn what is left over, each member stopped
      early on draws that it leaves out; stacking on those draws weighs them, the linear and the flat density
      (:class:`~..density.stacked.StackedDensity`).

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

    def __init__(
        self, *, correspondence: bool | Sequence[bool] = True, preset: str = "default", **options: Any
    ) -> None:
        self.correspondence = correspondence
        may_be_zero = ("weight_decay", "frames", "points", "time_epochs")
        self.settings: Settings = with_options(self.name, PRESETS, preset, options, may_be_zero)
        self._heads = tuple(self.settings.heads.split("+"))
        if not set(self._heads) <= set(_HEADS):
            raise InputError(f"npe-rkhs: heads must be of {' and '.join(_HEADS)}, not {self.settings.heads!r}")
        if self.settings.coordinates not in ("auto", *COORDINATES):
            named = ", ".join(("auto", *COORDINATES))
            raise InputError(f"npe-rkhs: coordinates must be one of {named}, not {self.settings.coordinates!r}")
        self._device = device_of(self.settings.device)
        self._reading: Reading | None = None
        self._density: StackedDensity | None = None

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
        flags, s = flags_of(self.correspondence, len(x)), self.settings
        self._reading, self._density = None, None
        with isolated(seed, s.threads) as generator:
            reading = Reading(
                x, flags, Draws.of(theta, weights), s.time_plan if s.time_epochs else None, s.principal, s.shown,
                generator, self._device,
            )  # fmt: skip
            shape = Shape(
                self._heads, s.members, s.held_out, s.coordinates, s.components, s.hidden, s.transforms, s.bins
            )
            self._density = StackedDensity(
                reading.training,
                reading.shown,
                theta,
                weights,
                shape,
                s.schedule(len(theta)),
                generator,
                self._device,
            )
            self._reading = reading

    def posterior(self, x: list[FloatArray]) -> FlowPosterior:
        """The posterior given one measurement.

        Raises:
            StepMissingError: before :meth:`fit`.
            InputError: recordings that do not fit those trained on, or nothing seen in one of them.
        """
        if self._reading is None or self._density is None:
            raise StepMissingError("npe-rkhs has no posterior before fit")
        batch = measured(x)
        with isolated(0, self.settings.threads), torch.no_grad():
            return self._density.posterior(self._reading(batch))

    @property
    def weights(self) -> dict[str, float]:
        """How much each kind of density counts, by name.

        Raises:
            StepMissingError: before :meth:`fit`.
        """
        if self._density is None:
            raise StepMissingError("npe-rkhs has no weights before fit")
        return dict(self._density.weights)
