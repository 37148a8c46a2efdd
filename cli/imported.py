"""What an import says of the recordings that it wrote: a line each, but no pages of them."""

from collections.abc import Sequence

import numpy as np

from ..core.measurement import Recording
from ..core.pose_span import uncovered
from ..core.series import seconds
from .console import say

#: So many recordings have a line each; of more the first few do, and those with a warning.
ALL, FIRST = 12, 3


def say_recordings(recordings: Sequence[Recording]) -> None:
    """Say what was written and what is odd about it."""
    remarks = [uncovered(recording) for recording in recordings]
    shown = [len(recordings) <= ALL or k < FIRST or bool(odd) for k, odd in enumerate(remarks)]
    for recording, odd, here in zip(recordings, remarks, shown, strict=True):
        if here:
            say("  " + summary(recording))
        for remark in odd:
            say(f"    warning: {remark}")
    if rest := [recording for recording, here in zip(recordings, shown, strict=True) if not here]:
        say("  " + _together(rest))


def summary(recording: Recording) -> str:
    """One line about a recording."""
    series = recording.series
    frames, count, axes = series.points.shape
    measured = [a for a in range(axes) if np.isfinite(series.points[..., a]).any()]
    span = [np.nanmax(series.points[..., a]) - np.nanmin(series.points[..., a]) for a in measured]
    extent = " x ".join(f"{s:.3g}" for s in span)
    which = "" if len(measured) == 3 else f" ({', '.join('xyz'[a] for a in measured)})"
    parts = [
        f"{recording.name}: {frames} frames from {seconds(series.time[0])} to {seconds(series.time[-1])} s",
        f"{count} points{'' if series.correspondence else ' without correspondence'}, {_seen(recording):.1%} seen",
        f"within {extent} {series.unit}{which}",
    ]
    if recording.camera is not None:
        parts.append(f"camera of {recording.camera.width} x {recording.camera.height} pixels")
    if recording.gripper is not None:
        parts.append(f"{recording.gripper.grippers} gripper(s)")
    if recording.load:
        parts.append(f"load {recording.load:g} kg")
    return ", ".join(parts)


def _together(recordings: Sequence[Recording]) -> str:
    """One line about many: between what and what they are, and the one that was seen least."""
    sizes = [recording.series.points.shape for recording in recordings]
    least = min(recordings, key=_seen)
    seen = "all seen" if _seen(least) == 1.0 else f"at least {_seen(least):.1%} seen (in {least.name})"
    frames, points = (_range([size[axis] for size in sizes]) for axis in (0, 1))
    return f"and {len(recordings)} more, to {recordings[-1].name}: {frames} frames, {points} points, {seen}"


def _range(numbers: Sequence[int]) -> str:
    low, high = min(numbers), max(numbers)
    return str(low) if low == high else f"{low} to {high}"


def _seen(recording: Recording) -> float:
    """Share of the points that were seen, in any coordinate."""
    return float(np.mean(np.isfinite(recording.series.points).any(axis=2)))
