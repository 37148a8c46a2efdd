"""Faults of motion capture along a cable: frames that were lost, and markers that were taken for one another."""

import warnings

import numpy as np

from ...core.arrays import BoolArray, FloatArray, IntArray

#: Frames were lost where most markers go more than this farther [m] ...
LOST_STEP = 0.001
#: ... and more than this many times as far as in the frames before and after [1]: one lost frame makes it twice as far.
LOST_RATIO = 1.5
#: Below this step [m] how many frames were lost cannot be told, as nothing moves.
LOST_FLOOR = 0.0005
#: More frames than this are not lost but a jump: the cable was somewhere else [1].
MOST_LOST = 25
#: A distance between neighbours is wrong if it is this far from its own median [m] ...
WRONG_DISTANCE = 0.018
#: ... and this many of its robust standard deviations [1]. The chord of a bent cable is shorter, too, but by less than
#: what two markers that change places move a distance by.
WRONG_DEVIATIONS = 6.0
#: Which of two neighbours is wrong, their distances to so many markers along the cable tell. A sharp bend shortens the
#: longer of these, too, so they alone make no frame wrong.
REACH = 3
#: Two markers of a gripper changed places if the wrong one is nearer to the cable by more than this [m].
ORDER_MARGIN = 0.005
#: A marker jumps if it goes by this much more than most markers do, and back in the next frame [m].
JUMP = 0.02


def lost_frames(markers: FloatArray) -> tuple[IntArray, BoolArray]:
    """How many frames are missing before every frame ``(T,)``, mostly 0, and whether it was a jump instead ``(T,)``.

    Motion capture that drops frames stores the next one as if nothing had happened: for one frame all markers go
    several times as far as before and after. How many times is the number of frames that passed. A cable that hardly
    moves and then is elsewhere has jumped: no clock explains that.

    Args:
        markers: ``(T, P, 3)`` [m], frame after frame, NaN where one was not seen.
    """
    missing, jumped = np.zeros(len(markers), np.int64), np.zeros(len(markers), bool)
    if len(markers) < 4:
        return missing, jumped
    steps = np.diff(markers, axis=0)
    far = _median(np.linalg.norm(steps, axis=2), axis=1)  # of most markers: a few may be wrong
    usual = _median(np.linalg.norm(0.5 * (steps[:-2] + steps[2:]), axis=2), axis=1)
    beside = np.maximum(far[:-2], far[2:])
    middle = far[1:-1]
    far_out = (middle > beside + LOST_STEP) & (middle > LOST_RATIO * beside) & np.isfinite(usual)
    count = np.rint(middle[far_out] / np.maximum(usual[far_out], 1e-12)) - 1
    possible = (usual[far_out] >= LOST_FLOOR) & (count <= MOST_LOST)
    at = 2 + np.flatnonzero(far_out)
    missing[at[possible]] = np.maximum(count[possible], 0)
    jumped[at[~possible]] = True
    return missing, jumped


def put_back(markers: FloatArray, clamped: IntArray) -> tuple[FloatArray, BoolArray]:
    """The markers with those of each gripper in their order, and in which frames ``(T,)`` they were not.

    A cable leaves its gripper on the side of the inner marker, so the next marker on the cable is nearer to that one,
    unless the two were taken for one another.

    Args:
        markers: ``(T, P, 3)`` [m], NaN where one was not seen.
        clamped: outer and inner marker of the first end, inner and outer of the last, from 0.
    """
    out, swapped = markers.copy(), np.zeros(len(markers), bool)
    for outer, inner in (clamped[:2], clamped[:1:-1]):
        beyond = inner + (1 if inner > outer else -1)
        if beyond in clamped or not 0 <= beyond < markers.shape[1]:
            continue
        to_inner, to_outer = (np.linalg.norm(markers[:, beyond] - markers[:, m], axis=1) for m in (inner, outer))
        wrong = to_inner > to_outer + ORDER_MARGIN  # a comparison with NaN is false
        out[wrong, outer], out[wrong, inner] = markers[wrong, inner], markers[wrong, outer]
        swapped |= wrong
    return out, swapped


def wrong_markers(markers: FloatArray) -> BoolArray:
    """Markers that cannot be where they seem to be ``(T, P)``.

    Of every frame in which a distance between neighbours leaves its own median, the fewest markers that explain all
    wrong distances: the one with most of them first. Also any marker that jumps by itself for one frame.

    Args:
        markers: ``(T, P, 3)`` [m] in their order along the cable, NaN where one was not seen.
    """
    frames, count = markers.shape[:2]
    bad = np.zeros((frames, count, count), bool)
    for gap in range(1, min(REACH, count - 1) + 1):
        apart = np.linalg.norm(markers[:, gap:] - markers[:, :-gap], axis=2)
        off = np.abs(apart - _median(apart, axis=0))
        spread = 1.4826 * _median(off, axis=0)
        first = np.arange(count - gap)
        bad[:, first, first + gap] = off > np.maximum(WRONG_DISTANCE, WRONG_DEVIATIONS * spread)
    bad |= bad.transpose(0, 2, 1)
    wrong = np.zeros((frames, count), bool)
    next_one = np.arange(count - 1)
    for t in np.flatnonzero(bad[:, next_one, next_one + 1].any(axis=1)):
        while bad[t].any():
            worst = int(np.argmax(bad[t].sum(axis=1)))
            wrong[t, worst] = True
            bad[t, worst] = bad[t, :, worst] = False
    steps = np.diff(markers, axis=0)
    alone = steps - _median(steps, axis=1)[:, None]
    there, back = alone[:-1], alone[1:]
    far = np.minimum(np.linalg.norm(there, axis=2), np.linalg.norm(back, axis=2)) > JUMP
    wrong[1:-1] |= far & (np.sum(there * back, axis=2) < 0)
    return wrong


def _median(values: FloatArray, axis: int) -> FloatArray:
    """Of what was seen; NaN where nothing was."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "All-NaN slice", RuntimeWarning)
        return np.asarray(np.nanmedian(values, axis=axis))
