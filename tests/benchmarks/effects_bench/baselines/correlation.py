"""The candidate whose one-step response looks most like the residual."""

import numpy as np

from .trial import Answer, Trial

#: Of the range of a coefficient.
STEP = 0.1
#: Residual variance over the noise's above which there is something to name.
MISFIT = 1.1


def correlation(trial: Trial) -> Answer:
    """The largest cosine between the residual of the fitted model and what a step of a coefficient changes."""
    plain = trial.objective().one(trial.unit)
    if float(plain @ plain) / (len(plain) * trial.noise.information) < MISFIT:
        return Answer(None)
    scores: dict[str, float] = {}
    for name in trial.candidates:
        start = trial.start(name)
        steps = []
        for k in range(len(trial.unit), len(start)):
            moved = start.copy()
            moved[k] += STEP if start[k] + STEP <= 1.0 else -STEP
            steps.append(moved)
        rows = trial.objective(name).many(np.array(steps))
        two_sided = [0.0 < start[k] < 1.0 for k in range(len(trial.unit), len(start))]
        for row, either in zip(rows, two_sided, strict=True):
            if row is None or not np.any(row != plain):
                continue
            change = row - plain  # of a residual: what helps points against it
            cosine = -float(change @ plain) / float(np.linalg.norm(change) * np.linalg.norm(plain))
            scores[name] = max(scores.get(name, -1.0), abs(cosine) if either else cosine)
    best = max(scores, key=lambda n: scores[n], default=None)
    return Answer(best if best is not None and scores[best] > 0 else None)
