"""Refit the model with every candidate, and take the least Bayesian information criterion."""

import numpy as np

from muslin.inference.polish import Polished, polish

from .trial import Answer, Trial

#: Least-squares evaluations of every refit, and where it starts in the range of each coefficient beside zero.
EVALUATIONS, OFF_ZERO = 12, 0.1


def bic(trial: Trial) -> Answer:
    """-2 log likelihood + k log n of the model alone and with each effect (Schwarz 1978), without any gate."""
    plain = polish(trial.objective(), trial.unit, EVALUATIONS)
    scores: dict[str | None, float] = {None: _criterion(plain)}
    for name in trial.candidates:
        start = trial.start(name)
        extra = slice(len(trial.unit), None)
        start[extra] += np.where(start[extra] + OFF_ZERO <= 1.0, OFF_ZERO, -OFF_ZERO)
        scores[name] = _criterion(polish(trial.objective(name), start, EVALUATIONS))
    return Answer(min(scores, key=lambda n: scores[n]))


def _criterion(fit: Polished) -> float:
    return fit.rss + len(fit.unit) * float(np.log(fit.count))
