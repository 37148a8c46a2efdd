"""Faults of motion capture along a cable: frames that were lost, and markers that were taken for one another."""

import numpy as np

from ...core.arrays import BoolArray, FloatArray, IntArray

#: Frames were lost where most markers go more than this farther [m] ...
LOST_STEP = 0.001
#: ... and more than this many times as far as in the frames before and after [1]. In the 168 published takes 0.99 of
#: all steps are less than 0.3 mm above those beside them; the few beyond 1 mm are mostly 2, some up to 13 times as far.
LOST_RATIO = 1.5
#: A distance between neighbours is wrong if it is this far from its own median [m] ...
WRONG_DISTANCE = 0.018
#: ... and this many of its robust standard deviations [1]. The chord of a bent cable is shorter, by 16 mm at most in
#: the published takes without faults; two markers that change places move a distance by 20 to 100 mm.
WRONG_DEVIATIONS = 6.0
#: Which of two neighbours is wrong, their distances to so many markers along the cable tell. A sharp bend shortens the
#: longer of these, too, so they alone make no frame wrong.
REACH = 3
#: A marker jumps if it goes by this much more than most markers do, and back in the next frame [m].
JUMP = 0.02


def lost_frames(markers: FloatArray) -> IntArray:
    """How many frames are missing before every frame ``(T,)``, mostly 0.

    Motion capture that drops frames stores the next one as if nothing had happened: for one frame all markers go
    several times as far as before and after. How many times is the number of frames that passed.

    Args:
        markers: ``(T, P, 3)`` [m], frame after frame.
    """
    missing = np.zeros(len(markers), np.int64)
    if len(markers) < 4:
        return missing
    steps = np.diff(markers, axis=0)
    far = np.median(np.linalg.norm(steps, axis=2), axis=1)  # of most markers: a few may be wrong
    usual = np.median(np.linalg.norm(0.5 * (steps[:-2] + steps[2:]), axis=2), axis=1)
    beside = np.maximum(far[:-2], far[2:])
    middle = far[1:-1]
    lost = (middle > beside + LOST_STEP) & (middle > LOST_RATIO * beside)
    missing[2:-1] = np.where(lost, np.maximum(np.rint(middle / np.maximum(usual, 1e-9)) - 1, 0), 0)
    return missing


def wrong_markers(markers: FloatArray) -> BoolArray:
    """Markers that cannot be where they seem to be ``(T, P)``.

    Of every frame in which a distance between neighbours leaves its own median, the fewest markers that explain all
    wrong distances: the one with most of them first. Also any marker that jumps by itself for one frame.

    Args:
        markers: ``(T, P, 3)`` [m] in their order along the cable.
    """
    frames, count = markers.shape[:2]
    bad = np.zeros((frames, count, count), bool)
    for gap in range(1, min(REACH, count - 1) + 1):
        apart = np.linalg.norm(markers[:, gap:] - markers[:, :-gap], axis=2)
        off = np.abs(apart - np.median(apart, axis=0))
        spread = 1.4826 * np.median(off, axis=0)
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
    alone = steps - np.median(steps, axis=1, keepdims=True)
    there, back = alone[:-1], alone[1:]
    far = np.minimum(np.linalg.norm(there, axis=2), np.linalg.norm(back, axis=2)) > JUMP
    wrong[1:-1] |= far & (np.sum(there * back, axis=2) < 0)
    return wrong
