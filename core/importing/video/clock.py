"""The clock of the frames and that of the gripper poses, brought together."""

from dataclasses import replace

import numpy as np

from ...arrays import BoolArray
from ...errors import InputError
from ...frames import Video
from ...motion import Motion
from .energy import estimated_offset
from .times import EPOCH


def aligned(video: Video, offset: float | None, where: str) -> tuple[Video, tuple[str, ...]]:
    """A video on the clock of its gripper poses, only frames that these cover, and what to tell of it.

    A frame is covered up to one frame interval before the first pose or after the last, which hold meanwhile.

    Args:
        video: time of the frames on their own clock.
        offset: added to it [s]; None: found from the motion.
        where: the file, for messages.

    Raises:
        InputError: the poses cover fewer than 2 frames, or the motion does not tell the offset.
    """
    gripper = video.gripper
    if gripper is None:
        if offset != 0.0:
            raise InputError(f"{where}: --offset shifts frames against gripper poses, but there are none; give --poses")
        return video, ()
    notes = []
    if offset is None:
        found = estimated_offset(video.time, video.frames, gripper)
        if not found.clear:
            raise InputError(f"{where}: the motion does not tell the offset ({found.reason}); give --offset SECONDS")
        offset = found.offset
        notes.append(f"offset {offset:+.3f} s, found from the motion (correlation {found.correlation:.2f})")
    elif offset:
        notes.append(f"offset {offset:+g} s, as given")
    video = replace(video, time=video.time + offset)
    covered = _covered(video, gripper)
    if covered.sum() < 2:
        apart = gripper.times[0] - video.time[0]
        raise InputError(
            f"{where}: the gripper poses go from {gripper.times[0]:.3f} to {gripper.times[-1]:.3f} s, but the frames "
            f"from {video.time[0]:.3f} to {video.time[-1]:.3f} s; they have different clocks: --offset {apart:.3f} "
            "has both begin together, --offset auto looks for it in the motion"
        )
    notes.append(_beginning(float(video.time[0] - gripper.times[0])))
    if not covered.all():
        lost = video.time[~covered]
        notes.append(
            f"left out {len(lost)} of {len(covered)} frames, from {lost[0]:.3f} to {lost[-1]:.3f} s, which no gripper "
            "pose covers"
        )
        video = replace(video, time=video.time[covered], frames=video.frames[covered])
    if (origin := float(video.time[0])) > EPOCH:
        # a time since 1970 has no digits left for what is between two frames where it is printed or stored short
        video = replace(video, time=video.time - origin, gripper=Motion(gripper.times - origin, gripper.poses))
        notes.append(f"time 0 is {origin:.3f} s of the poses")
    return video, tuple(notes)


def doubtful_offset(video: Video) -> str:
    """What to tell if the motion in the pictures speaks for another offset, else nothing; for an aligned video."""
    if video.gripper is None:
        return ""
    found = estimated_offset(video.time, video.frames, video.gripper)
    if not found.clear or abs(found.offset) < 2.0 * float(np.median(np.diff(video.time))):
        return ""
    return (
        f"the motion in the pictures fits the poses better with {found.offset:+.3f} s more (correlation "
        f"{found.correlation:.2f}): --offset auto takes that"
    )


def _covered(video: Video, gripper: Motion) -> BoolArray:
    if len(gripper.times) < 2:  # one pose holds for all time
        return np.ones(len(video.time), bool)
    slack = 1.01 * float(np.median(np.diff(video.time)))  # times are written with few digits
    return np.asarray((video.time >= gripper.times[0] - slack) & (video.time <= gripper.times[-1] + slack))


def _beginning(seconds: float) -> str:
    if abs(seconds) < 5e-4:
        return "the first frame is at the time of the first pose"
    return f"the first frame is {abs(seconds):.3f} s {'after' if seconds > 0 else 'before'} the first pose"
