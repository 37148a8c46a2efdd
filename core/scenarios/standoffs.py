"""How far markers stand beside the axis of a rope, told by how their distances change as it bends."""

from collections.abc import Sequence

import numpy as np

from ..arrays import FloatArray
from ..beside import Beside, closing_angles, curves, frames_at
from ..errors import InputError
from ..measurement import Recording, check_spatial

#: Frames are taken so far apart [s]: nearer ones show the same bends.
_APART = 0.1
#: Fewer frames with all markers, of all recordings, tell nothing.
_FEWEST = 20
#: What an offset may be expected to be [m]; it counts as this many frames do.
_USUAL, _WEIGHT = 0.01, 25.0
_ROUNDS = 8
#: Distances that are further off than this many robust standard deviations hardly count.
_FAR = 3.0
#: Markers that stand further beside the axis than this are worth a word, root mean square [m].
_MATTERS = 0.005


def standing_off(recordings: Sequence[Recording]) -> float:
    """How far the markers of a rope stand beside its axis, root mean square [m].

    Zero where that is too little to matter, and where the recordings do not tell.
    """
    try:
        offsets = told_standoffs(recordings).offsets
    except InputError:
        return 0.0
    away = float(np.sqrt(np.mean(np.sum(offsets**2, axis=1))))
    return away if away > _MATTERS else 0.0


def told_standoffs(recordings: Sequence[Recording]) -> Beside:
    r"""Where the markers of a rope stand, the same in all ``recordings``.

    A rope keeps the lengths :math:`L_i` between the places of its markers. Of markers that stand :math:`d` beside the
    axis the distances do not: where it is bent by the curvature :math:`\kappa`, they are
    :math:`L_i (1 - \kappa \cdot d)`. So those offsets are taken that leave the lengths of the axis least scatter, by
    Gauss-Newton steps with weights that fall off as of a normal distribution. The first two markers, and the last two,
    are taken to stand alike: between them a rope that is clamped does not bend, so nothing else tells them apart.
    Nothing is simulated.

    Raises:
        InputError: not markers in order between two grippers, or too few frames show all of them.
    """
    used = [_frames(r) for r in recordings]
    if sum(len(points) for points, _ in used) < _FEWEST:
        raise InputError(
            f"[scenario.markers] = 'beside' tells from frames that show every marker where they stand, but of "
            f"{', '.join(r.name for r in recordings)} only {sum(len(p) for p, _ in used)} do, {_APART:g} s apart; at "
            f"least {_FEWEST} are needed: leave it out, or fit on more recordings"
        )
    counts = {r.name: r.series.points.shape[1] for r in recordings}
    if len(set(counts.values())) > 1:
        told = ", ".join(f"{name} has {count}" for name, count in counts.items())
        raise InputError(f"[scenario.markers] = 'beside' is for recordings of the same markers, but {told}")
    count = used[0][0].shape[1]
    used = [(points, poses) for points, poses in used if len(points)]
    found = Beside(np.zeros((count, 2)), _turn(used))
    for _ in range(_ROUNDS):
        found = Beside(_stepped(found, used), found.turn)
    return found


def _frames(recording: Recording) -> tuple[FloatArray, FloatArray]:
    """Points ``(T, M, 3)`` and poses ``(T, 2, 7)`` of frames that show every marker, neighbours apart."""
    check_spatial(recording)
    series, motion = recording.series, recording.gripper
    if not series.correspondence or series.points.shape[1] < 4 or motion is None or motion.grippers != 2:
        raise InputError(
            f"[scenario.markers] = 'beside' is for ropes with at least 4 markers in order between two grippers, but "
            f"recording {recording.name!r} is another"
        )
    apart = np.linalg.norm(np.diff(series.points, axis=1), axis=2)
    whole = np.flatnonzero((apart > 0).all(axis=1))  # a comparison with NaN is false
    late = np.floor((series.time[whole] - series.time[0]) / _APART)
    kept = whole[np.unique(late, return_index=True)[1]]
    return series.points[kept], motion.at(series.time[kept])


def _turn(used: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """The mean of what closes the frame: no take is twisted for good."""
    angles = np.concatenate([closing_angles(curves(points)[0], poses) for points, poses in used])
    return float(np.angle(np.mean(np.exp(1j * angles))))


def _stepped(now: Beside, used: Sequence[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """Offsets ``(M, 2)`` after one Gauss-Newton step: lengths along the axis are linear in small changes of them."""
    lengths, slopes = [], []
    for points, poses in used:
        axis = now.axis(points, poses)
        frames = frames_at(axis, poses, now.turn)
        curve, places = curves(axis)
        so_far = np.cumsum(np.linalg.norm(np.diff(curve, axis=1), axis=2), axis=1)
        so_far = np.concatenate([np.zeros((len(axis), 1)), so_far], axis=1)[:, places]
        lengths.append(np.diff(so_far, axis=1))
        chords = np.diff(axis, axis=1)
        chords /= np.linalg.norm(chords, axis=2, keepdims=True)
        count = axis.shape[1]
        slope = np.zeros((len(axis), count - 1, count, 2))
        k = np.arange(count - 1)
        slope[:, k, k] = np.einsum("tkx,tkax->tka", chords, frames[:, :-1])
        slope[:, k, k + 1] = -np.einsum("tkx,tkax->tka", chords, frames[:, 1:])
        slope[:, :, 1] += slope[:, :, 0]
        slope[:, :, -2] += slope[:, :, -1]
        slopes.append(slope[:, :, 1:-1])
    off, change = (np.concatenate(x) for x in (lengths, slopes))
    off, change = off - np.median(off, axis=0), change - change.mean(axis=0)
    spread = 1.4826 * float(np.median(np.abs(off)))
    weight = np.exp(-0.25 * (off / max(_FAR * spread, 1e-12)) ** 2)
    rows = (change * weight[..., None, None]).reshape(off.size, -1)
    inner = now.offsets[1:-1].ravel()
    keep = np.sqrt(_WEIGHT) * max(spread, 1e-9) / _USUAL
    whole = np.concatenate([rows, keep * np.eye(len(inner))])
    step = np.linalg.lstsq(whole, np.concatenate([-(off * weight).ravel(), -keep * inner]), rcond=None)[0]
    found = (inner + step).reshape(-1, 2)
    return np.concatenate([found[:1], found, found[-1:]])
