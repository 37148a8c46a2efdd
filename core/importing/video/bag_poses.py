"""Gripper poses of a bag: of one topic, or of several, one a gripper."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import InputError
from ...motion import Motion
from ..gripper import to_motion
from ..raw import RawGripper
from .bag_messages import messages, stamp
from .options import Clock


@dataclass(frozen=True, eq=False)
class TopicPoses:
    """Poses of one gripper on the clock of the bag, and what to tell of them.

    Args:
        gripper: of one gripper; times [s], positions [unit of the poses].
        delay: median time from measuring to writing [s].
        note: which topic, in which frame.
    """

    gripper: RawGripper
    delay: float
    note: str


def topic_poses(reader: Any, topic: str, child: str, clock: Clock, where: str) -> TopicPoses:
    """Poses of a topic.

    Args:
        reader: of the bag.
        topic: of poses or transforms.
        child: frame of the gripper among several transforms; empty: the only one.
        clock: time of the header, or of writing.
        where: the bag, for messages.

    Raises:
        InputError: there are none, of several frames, or without a time.
    """
    times, poses, delays, frames, children = [], [], [], set(), set()
    for log, message in messages(reader, topic):
        for part in getattr(message, "transforms", [message]):
            own = getattr(part, "child_frame_id", "")
            children.add(own)
            if child and own != child:
                continue
            if hasattr(part, "pose"):
                place, turn = part.pose.position, part.pose.orientation
            else:
                place, turn = part.transform.translation, part.transform.rotation
            times.append(log if clock == "log" else stamp(part))
            delays.append(log - stamp(part))
            poses.append([place.x, place.y, place.z, turn.w, turn.x, turn.y, turn.z])
            frames.add((part.header.frame_id, own))
    if not child and len(children) > 1:
        raise InputError(
            f"{where}: {topic} holds poses of {', '.join(sorted(children))}; say --pose {topic}:FRAME (once a gripper) "
            "or --pose none"
        )
    if not poses:
        what = f" of frame {child!r}; it has {', '.join(sorted(children))}" if child else ""
        raise InputError(f"{where}: topic {topic} holds no poses{what}")
    if clock == "header" and min(times) <= 0:
        raise InputError(f"{where}: poses of {topic} have no time in their header; say --clock log")
    order = np.argsort(np.array(times), kind="stable")
    told = ", ".join(sorted({f"{parent!r}" for parent, _ in frames}))
    return TopicPoses(
        RawGripper(np.array(times)[order], np.array(poses)[order][:, None]),
        float(np.median(delays)),
        f"gripper poses of {topic}{f':{child}' if child else ''} in frame {told}, which must be that of the camera",
    )


def together(parts: Sequence[TopicPoses], where: str) -> RawGripper:
    """Grippers with times of their own as one motion: all their times, as long as every one of them is known.

    Raises:
        InputError: they share no time.
    """
    if len(parts) == 1:
        return parts[0].gripper
    motions: list[Motion] = []
    for k, part in enumerate(parts):
        own = part.gripper
        kept = np.append(np.diff(own.times) > 0, True)  # of two poses at one time the latter
        motions.append(to_motion(RawGripper(own.times[kept], own.poses[kept]), "m", "z", f"{where}, gripper {k}"))
    begin, end = max(m.times[0] for m in motions), min(m.times[-1] for m in motions)
    times = np.unique(np.concatenate([m.times for m in motions]))
    times = times[(times >= begin) & (times <= end)]
    if len(times) < 2:
        raise InputError(
            f"{where}: the grippers' poses share no time: the last begins {begin - end:.3f} s after the first has "
            "ended; take one of them with --pose, or --clock log if their clocks differ"
        )
    return RawGripper(times, np.concatenate([m.at(times) for m in motions], axis=1))
