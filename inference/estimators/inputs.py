"""What every estimator looks for in what it is given."""

from collections.abc import Sequence

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ..density.training import importance_weights

#: Fewer draws than this are no basis for a posterior.
MIN_DRAWS = 10


def flags_of(correspondence: bool | Sequence[bool], recordings: int) -> tuple[bool, ...]:
    """One flag a recording.

    Raises:
        InputError: as many flags as there are no recordings.
    """
    if isinstance(correspondence, bool):
        return (correspondence,) * recordings
    flags = tuple(bool(c) for c in correspondence)
    if len(flags) != recordings:
        raise InputError(f"correspondence names {len(flags)} recordings, but there are {recordings}")
    return flags


def checked(
    theta: FloatArray, x: list[FloatArray], log_weights: FloatArray | None
) -> tuple[FloatArray, list[FloatArray], FloatArray]:
    """Draws of weight above zero ``theta, x, weights`` (of mean one), all that could be wrong looked for.

    Raises:
        InputError: fewer than :data:`MIN_DRAWS` draws, shapes that do not fit, parameters outside the unit cube,
            draws in which nothing was seen, or weights that make no sense.
    """
    theta = np.asarray(theta, float)
    if theta.ndim != 2 or theta.shape[1] == 0:
        raise InputError(f"theta must have shape (N, D), but has {theta.shape}")
    if not (np.isfinite(theta).all() and (theta >= 0).all() and (theta <= 1).all()):
        raise InputError("theta must lie in the unit cube; map values with ParameterSpace.to_unit")
    draws = len(theta)
    if not x:
        raise InputError("x needs at least one recording")
    x = [np.asarray(a, float) for a in x]
    for r, a in enumerate(x):
        if a.ndim != 4 or len(a) != draws or 0 in a.shape[1:]:
            raise InputError(f"recording {r} must have shape ({draws}, T, P, A), but has {a.shape}")
        if a.shape[3] != x[0].shape[3]:
            raise InputError(f"recordings must share their axes, but have {[b.shape[3] for b in x]}")
        if np.isinf(a).any():
            raise InputError(f"recording {r} holds an infinite coordinate; leave failed draws out")
        empty = np.flatnonzero(~np.isfinite(a).all(axis=3).reshape(draws, -1).any(axis=1))
        if len(empty):
            raise InputError(
                f"in recording {r}, {len(empty)} of {draws} draws have no point that was seen "
                f"(the first is draw {empty[0]}); leave failed draws out before fitting"
            )
    weights = importance_weights(log_weights, draws)
    kept = weights > 1e-8
    if kept.sum() < MIN_DRAWS:
        raise InputError(
            f"{int(kept.sum())} draws with a weight above zero are too few to train on; at least {MIN_DRAWS} are "
            "needed, and some hundreds are sensible"
        )
    return theta[kept], [a[kept] for a in x], weights[kept] / weights[kept].mean()


def measured(x: list[FloatArray]) -> list[FloatArray]:
    """One measurement ``(T_r, P, A)`` a recording as a batch of one.

    Raises:
        InputError: a recording of another shape, or with nothing seen.
    """
    batch = [np.asarray(a, float)[None] for a in x]
    for r, a in enumerate(batch):
        if a.ndim != 4:
            raise InputError(f"recording {r} of a measurement needs shape (T, P, A), but has {a.shape[1:]}")
        if not np.isfinite(a).all(axis=3).any():
            raise InputError(f"recording {r} of the measurement has no point that was seen")
    return batch
