"""The estimator that tries estimators: those that predict left-out draws best are mixed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...core.arrays import BoolArray, FloatArray
from ...core.errors import InputError, StepMissingError
from ...core.estimator import PosteriorEstimator
from ...core.registry import REGISTRY
from ..density.stacking import stack
from ..posterior.stacked import StackedPosterior
from .inputs import MIN_DRAWS, checked, flags_of, measured
from .options import with_options

#: Tried when nothing else is asked for.
ESTIMATORS = ("npe-rkhs", "bayessim-rkhs", "bayessim-mdnn")


@dataclass(frozen=True)
class Settings:
    """Every option of ``auto`` beside the names of the estimators.

    Args:
        held_out: part of the draws that is left out to compare on.
        compared: of these, how many at most are compared on; each costs a posterior of every estimator.
        least: an estimator of less weight than this is dropped before the second training.
    """

    held_out: float = 0.2
    compared: int = 300
    least: float = 0.05


# The estimators have presets of their own; "paper" is theirs.
PRESETS = {"default": Settings(), "paper": Settings()}


class Auto(PosteriorEstimator):
    """Trains several registered estimators and mixes their posteriors by what they say of draws left out.

    Every estimator is trained on most of the draws; stacking (:func:`~..density.stacking.stack`) on the others finds
    the weights under which the mixture predicts best; those of some weight are trained again, on all draws. The
    mixture does on the left-out draws at least as well as the best estimator alone. It costs about twice the
    estimators together. An estimator that refuses the draws is left out, as long as one takes them.

    Args:
        correspondence: given to every estimator.
        preset: given to every estimator.
        estimators: names in the registry, :data:`ESTIMATORS` by default.
        options: any field of :class:`Settings`.

    Raises:
        InputError: no names, a name twice, ``auto`` itself, an option that makes no sense.
        UnknownPluginError: a name that is not registered.
    """

    name: ClassVar[str] = "auto"

    def __init__(
        self,
        *,
        correspondence: bool | Sequence[bool] = True,
        preset: str = "default",
        estimators: Sequence[str] = ESTIMATORS,
        **options: Any,
    ) -> None:
        self.settings: Settings = with_options(self.name, PRESETS, preset, options, ("least",))
        if self.settings.held_out >= 1:
            raise InputError(f"auto: held_out must be a part below one, not {self.settings.held_out}")
        if isinstance(estimators, str) or not all(isinstance(e, str) for e in estimators):
            raise InputError(f"auto: estimators must be a list of names, not {estimators!r}")
        names = tuple(estimators)
        if not names or len(set(names)) < len(names) or self.name in names:
            raise InputError(f"auto needs names of other estimators, each once, not {list(names)}")
        self.correspondence, self.preset, self.names = correspondence, preset, names
        for each in names:
            self._make(each)
        self._fitted: dict[str, PosteriorEstimator] = {}
        self.weights: dict[str, float] = {}

    def _make(self, name: str) -> PosteriorEstimator:
        made: PosteriorEstimator = REGISTRY.get("estimator", name)(
            correspondence=self.correspondence, preset=self.preset
        )
        return made

    def fit(
        self, theta: FloatArray, x: list[FloatArray], *, log_weights: FloatArray | None = None, seed: int = 0
    ) -> None:
        """Train, replacing whatever was trained before; arguments and errors as of the estimators it tries."""
        theta, x, weights = checked(theta, x, log_weights)
        flags_of(self.correspondence, len(x))
        self._fitted, self.weights = {}, {}
        held = np.zeros(len(theta), bool)
        # Half of MIN_DRAWS to compare on and MIN_DRAWS to train on are the least that make sense.
        count = min(max(int(self.settings.held_out * len(theta)), MIN_DRAWS // 2), len(theta) - MIN_DRAWS)
        if len(self.names) > 1 and count > 0:
            held[np.random.default_rng(seed).permutation(len(theta))[:count]] = True
            found = self._compared(theta, x, weights, held, seed)
        else:
            found = dict.fromkeys(self.names, 1.0 / len(self.names))
        fitted = {}
        for name in found:
            estimator = self._make(name)
            estimator.fit(theta, x, log_weights=np.log(weights), seed=seed)
            fitted[name] = estimator
        total = sum(found.values())
        self.weights = {name: w / total for name, w in found.items()}
        self._fitted = fitted

    def _compared(
        self, theta: FloatArray, x: list[FloatArray], weights: FloatArray, held: BoolArray, seed: int
    ) -> dict[str, float]:
        """Weights of the estimators worth training on all draws."""
        kept, rows = ~held, np.flatnonzero(held)[: self.settings.compared]
        scores: dict[str, FloatArray] = {}
        refused: InputError | None = None
        for name in self.names:
            estimator = self._make(name)
            try:
                estimator.fit(theta[kept], [a[kept] for a in x], log_weights=np.log(weights[kept]), seed=seed)
            except InputError as error:
                refused = error
                continue
            scores[name] = np.array(
                [float(estimator.posterior([a[i] for a in x]).log_prob(theta[i : i + 1])[0]) for i in rows]
            )
        if not scores:
            raise refused or InputError("auto has no estimator to try")
        found = stack(np.stack(list(scores.values()), axis=1), weights[rows])
        kept_weights = np.where(found >= min(self.settings.least, found.max()), found, 0.0)
        return {name: float(w) for name, w in zip(scores, kept_weights, strict=True) if w > 0}

    def posterior(self, x: list[FloatArray]) -> StackedPosterior:
        """The posterior given one measurement.

        Raises:
            StepMissingError: before :meth:`fit`.
            InputError: recordings that do not fit those trained on, or nothing seen in one of them.
        """
        if not self._fitted:
            raise StepMissingError("auto has no posterior before fit")
        measured(x)
        return StackedPosterior(
            np.array([self.weights[name] for name in self._fitted]),
            [estimator.posterior(x) for estimator in self._fitted.values()],
        )
