"""What a comparison keeps of one recording beyond errors: draws, phases, and points as sets."""

from dataclasses import dataclass

import numpy as np
import zarr

from ...core.arrays import FloatArray, IntArray
from ...core.store import read


@dataclass(frozen=True, eq=False)
class Sets:
    """Measured and predicted points of a frame as distributions; see the step ``compare``.

    Args:
        mmd, threshold: maximum mean discrepancy and what noise alone stays below ``(T,)``.
        worst: frame of the witness.
        witness: positive where more was measured than predicted ``(W, n, n)``, rows upwards.
        low, high: corners of its grid in each view ``(W, 2)``.
        limit: what noise alone stays below ``(W,)``.
    """

    mmd: FloatArray
    threshold: FloatArray
    worst: int
    witness: FloatArray
    low: FloatArray
    high: FloatArray
    limit: FloatArray


@dataclass(frozen=True, eq=False)
class Compared:
    """One recording.

    Args:
        predicted: of the best fit ``(T, Q, A)``.
        difference: measured minus predicted, offsets taken out ``(T, P, A)``.
        draws: predictions of posterior draws ``(K, T, Q, A)``; K may be 0.
        motion: phase of each frame ``(T,)``, an index into ``phases``.
        phases: names of phases.
        views: right and up of one or two views ``(W, 2, A)``.
        distance: of predicted points from the grasp along the object ``(Q,)`` [m], or None.
        sets: points as sets.
    """

    predicted: FloatArray
    difference: FloatArray
    draws: FloatArray
    motion: IntArray
    phases: tuple[str, ...]
    views: FloatArray
    distance: FloatArray | None
    sets: Sets


def read_compared(group: zarr.Group) -> Compared | None:
    """What ``compare`` wrote about one recording; None if an older muslin did."""
    if "witness" not in group or "motion_phase" not in group:
        return None

    def array(name: str) -> FloatArray:
        return np.asarray(read(group, name), float)

    predicted, attrs = array("predicted"), dict(group.attrs)
    names = ("witness", "witness_low", "witness_high", "witness_limit")
    sets = Sets(array("mmd"), array("mmd_threshold"), int(str(attrs["sets_worst_frame"])), *(array(n) for n in names))
    return Compared(
        predicted=predicted,
        difference=array("difference"),
        draws=array("draws") if "draws" in group else np.zeros((0, *predicted.shape)),
        motion=array("motion_phase").astype(np.int64),
        phases=tuple(str(n) for n in attrs["motion_phases"]),  # type: ignore[union-attr]
        views=array("views"),
        distance=array("distance_from_grasp") if "distance_from_grasp" in group else None,
        sets=sets,
    )


def distance(apart: FloatArray) -> FloatArray:
    """Lengths ``(...)`` of differences ``(..., A)``, along the axes that were seen; NaN where none was."""
    seen = np.isfinite(apart)
    length = np.sqrt(np.sum(np.where(seen, apart, 0.0) ** 2, axis=-1))
    return np.asarray(np.where(seen.any(axis=-1), length, np.nan))


def view_name(view: FloatArray) -> str:
    """What is to the right and what is up in a view ``(2, A)``."""
    names = []
    for direction in view:
        k = int(np.abs(direction).argmax())
        level = direction.copy()
        level[k] = 0.0
        if np.linalg.norm(level) < 0.2:
            names.append(("−" if direction[k] < 0 else "") + "xyz"[k])
        else:
            names.append(f"{np.degrees(np.arctan2(direction[1], direction[0])):.0f}° from x".replace("-", "−"))
    if view.shape[1] == 2 and view[1, 1] < 0:
        return "as in the picture"
    return f"{names[0]} →   {names[1]} ↑"
