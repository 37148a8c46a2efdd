"""From the draws of all rounds so far to the posterior given the measurement."""

from ...core.arrays import FloatArray, IntArray
from ...core.errors import InputError
from ...core.estimator import Posterior, PosteriorEstimator
from ...core.registry import REGISTRY, check_options
from ...core.study import Study
from ..calibration.warn import calibration_warnings
from .proposals import Proposals
from .span import Span
from .takes import Takes


def make_estimator(study: Study, correspondence: list[bool]) -> PosteriorEstimator:
    """The estimator of a study, untrained.

    Args:
        study: whose ``[estimator]``.
        correspondence: of the recordings that it is to see.

    Raises:
        InputError: there is none of that name, or it does not take the options.
    """
    table = study.config.estimator
    options = dict(table.options)
    if not all(correspondence):
        options.setdefault("correspondence", False)
    plugin = REGISTRY.get("estimator", table.name)
    check_options("estimator", table.name, plugin, options)
    try:
        made: PosteriorEstimator = plugin(**options)
    except TypeError as error:
        raise InputError(f"[estimator] {table.name!r} does not take these options: {error}") from error
    return made


class Learner:
    """Trains the estimator of a study, anew in every round and on the draws of all.

    Args:
        study: whose ``[estimator]``.
    """

    def __init__(self, study: Study) -> None:
        self._study = study
        self._correspondence: list[bool] = []
        self._measured: list[FloatArray] = []  # as the estimator sees it
        self.redone = 0  # rounds that were learned anew, after a division that gave no density
        self.estimator: PosteriorEstimator | None = None
        # parameters, what was seen, and log weights of the draws of the last training
        self.trained_on: tuple[FloatArray, list[FloatArray], FloatArray | None] | None = None

    @property
    def log_weights(self) -> FloatArray | None:
        """``(N,)`` that the last training used; None where all draws weighed the same."""
        return None if self.trained_on is None else self.trained_on[2]

    def learn(
        self,
        takes: Takes,
        predicted: list[FloatArray],
        theta: FloatArray,
        points: list[FloatArray],
        numbers: IntArray,
        proposals: Proposals,
        round_number: int,
    ) -> Posterior:
        """The posterior given the measurement, under the prior.

        Args:
            takes: what is seen of a draw, and what was measured.
            predicted: by the best fit, ``(T, P, A)`` a group of takes; none if it cannot be simulated again.
            theta: whole draws ``(N, D)``, in the unit cube.
            points: of the recordings that are simulated, clean, ``(N, T, P, A)``.
            numbers: of the draws ``(N,)``.
            proposals: of all rounds so far.
            round_number: from zero.
        """
        seed, log_weights = self._study.config.study.seed, proposals.log_weights(theta)
        span, self._correspondence = Span(takes, points, log_weights), takes.correspondence
        flawed = takes.observe(points, numbers, seed)
        seen, self._measured = span(flawed), span.measured(predicted, flawed) if predicted else span(takes.measured())
        learned = self._train(theta, seen, log_weights, seed + round_number)
        posterior = proposals.corrected(learned)
        if posterior is None:
            self.redone += 1
            weights = proposals.log_weights(theta, under_prior=True)
            posterior = self._train(theta, seen, weights, seed + round_number)
        return posterior

    def _train(self, theta: FloatArray, seen: list[FloatArray], weights: FloatArray | None, seed: int) -> Posterior:
        self.estimator, self.trained_on = self.untrained(), (theta, seen, weights)
        self.estimator.fit(theta, seen, log_weights=weights, seed=seed)
        return self.estimator.posterior(self._measured)

    def untrained(self) -> PosteriorEstimator:
        """The estimator of the study, without any training."""
        return make_estimator(self._study, self._correspondence)

    def calibration_notes(self) -> list[str]:
        """Sentences for people where the last training gave posteriors that promise more than they hold."""
        if self.trained_on is None:
            return []
        names = self._study.problem.space.names
        return calibration_warnings(self.untrained, *self.trained_on, self._study.config.study.seed, names)

    def notes(self) -> list[str]:
        """Sentences for people on what the training met."""
        if not self.redone:
            return []
        return [
            f"in {self.redone} round{'s' * (self.redone > 1)} the learned mixture could not be divided by the "
            "proposal (a component was wider than it), and importance weights were used instead; "
            '[estimator] proposal = "truncated" needs no division'
        ]


def after_training(learner: Learner, posterior: Posterior, samples: FloatArray) -> list[str]:
    """What is checked once the last posterior is there, as sentences for people; empty if nothing is wrong.

    Args:
        learner: with the trained estimator.
        posterior: the last one.
        samples: of it ``(S, D)``, in the unit cube.
    """
    return [*learner.notes(), *learner.calibration_notes()]
