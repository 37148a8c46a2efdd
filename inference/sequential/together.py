"""What a misfit tells of parameters, whose errors go together in time, so that they are fewer than they seem."""

from dataclasses import replace

import numpy as np

from ...core.arrays import FloatArray
from ..polish import MISFIT, Objective, Polished
from ..residuals import by_residual

#: Scores are added up over so many blocks of time at least, of all recordings together.
BLOCKS = 8


def told_together(objective: Objective, best: Polished) -> Polished:
    """The same fit, knowing how much less its residuals tell as they go together in time.

    Scores (derivatives of the log likelihood by the parameters) of noise vary by as much as the curvature says. Those
    of a misfit that lasts add up over the time that it lasts: another stretch of the same motion, or another take,
    would put the best fit elsewhere, however many frames there are. By how much, scores summed over blocks of time
    tell. The likelihood to the power of ``D / tr(H^-1 J)``, with the curvature ``H`` and the variance ``J`` of the
    scores, is as wide in the mean over D parameters as the best fit varies (Pauli, Racugno and Ventura, *Bayesian
    composite marginal likelihoods*, 2011; Ribatet, Cooley and Davison, 2012). Blocks are halved from whole recordings
    on; the largest variance counts.

    Args:
        objective: that was made least.
        best: where, with its derivatives; where it leaves no misfit, or parameters do nothing, it is as it was.
    """
    if best.left < MISFIT or not best.jacobian.any():  # of parameters that do nothing there are no scores
        return best
    scores = _by_frame(objective, best)
    known = best.covariance / best.grown
    curvature = float(np.sum(known * (best.jacobian.T @ best.jacobian)))
    largest, parts = 0.0, 1
    while parts <= min(len(s) for s in scores):
        sums = np.concatenate([_summed(s, parts) for s in scores])
        if len(sums) >= BLOCKS:
            variance = sums.T @ sums * len(sums) / (len(sums) - 1)  # of scores that add up to nothing at the best fit
            largest = max(largest, float(np.sum(known * variance)) / curvature)
        parts *= 2
    return replace(best, together=largest)


def _by_frame(objective: Objective, best: Polished) -> list[FloatArray]:
    """Scores ``(T, D)`` of every recording; those of its offsets go with its first frame."""
    each, out = best.jacobian * best.white[:, None], list[FloatArray]()
    for name in objective.recordings:
        recording = objective.pool.problem.recordings[name]
        count = recording.series.frames
        frames = by_residual(recording, objective.offsets, np.arange(count, dtype=float)).astype(np.int64)
        own, each = each[: len(frames)], each[len(frames) :]
        out.append(np.stack([np.bincount(frames, column, count) for column in own.T], axis=1).astype(float))
    return out


def _summed(scores: FloatArray, parts: int) -> FloatArray:
    """``scores (T, D)`` over so many blocks of time that follow each other ``(parts, D)``."""
    return np.stack([block.sum(axis=0) for block in np.array_split(scores, parts)])
