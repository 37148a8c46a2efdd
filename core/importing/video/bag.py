"""MCAP files and ROS bags, through rosbags, which reads those of ROS 2 (MCAP, SQLite) and of ROS 1 without ROS."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...optional import library
from ...picture import DepthImage, Image
from ..raw import RawGripper
from .bag_messages import colour, depth, messages, stamp
from .bag_poses import TopicPoses, together, topic_poses
from .options import Clock, VideoOptions
from .raw import RawVideo

_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_POSES = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped", "tf2_msgs/msg/TFMessage")
#: So many messages tell how far stamps lie before the time of writing.
_ASKED = 20
#: Delays of pictures and poses that differ by more than this are of two clocks, not of two cables [s].
_TWO_CLOCKS = 0.5


def is_bag(path: Path) -> bool:
    """Whether a file or folder is one."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file()
    return path.suffix.lower() in (".mcap", ".db3", ".bag")


def read_bag(path: Path, options: VideoOptions) -> list[RawVideo]:
    """The one take of a bag. Its time begins with the first picture.

    Raises:
        InputError: no such bag, or no such topic; the message lists those that there are.
    """
    with _opened(path) as reader:
        topic = _topic(reader, _IMAGES, options.image, path, "image", "--image", options.depth_topic)
        if topic is None:
            raise InputError(f"{path} has no topic with images; it has {_listed(reader)}")
        if options.depth_topic is not None:
            _topic(reader, _IMAGES, options.depth_topic, path, "depth", "--depth-topic")
        asked = [(log, stamp(message)) for log, message in islice(messages(reader, topic), _ASKED)]
        if not asked:
            raise InputError(f"{path}: topic {topic} holds no messages")
        clock, notes = _clock(options.clock, asked, path)
        origin = asked[0][0 if clock == "log" else 1]
        gripper = None
        parts = [] if options.gripper is not None else _poses(reader, options.pose, clock, path)
        if parts:
            gripper = together(parts, str(path))
            gripper = RawGripper(gripper.times - origin, gripper.poses)
            notes += [part.note for part in parts]
    if clock == "header":
        own = float(np.median([log - header for log, header in asked]))
        notes.append(f"pictures have the time of their header, {own:.3f} s before they were written")
        if other := [part.delay for part in parts if abs(part.delay - own) > _TWO_CLOCKS]:
            notes.append(
                f"headers of poses lie {other[0]:.3f} s before they were written, which are two clocks; --clock log "
                "takes the time of writing"
            )
    notes.append(f"time 0 is {origin:.3f} s in the bag")
    frames = partial(_frames, path, topic, clock, origin, options.fps)
    depths = None if options.depth_topic is None else partial(_depths, path, options.depth_topic, clock, origin)
    return [RawVideo(str(path), path.stem, frames, depths=depths, gripper=gripper, origin=origin, notes=tuple(notes))]


def _poses(reader: Any, wanted: tuple[str, ...], clock: Clock, path: Path) -> list[TopicPoses]:
    """Poses of the topics that were asked for, one a gripper; of the only one if none was."""
    if wanted == ("none",):
        return []
    found = []
    for text in wanted or ("",):
        name, _, child = text.partition(":")
        topic = _topic(reader, _POSES, name or None, path, "pose", "--pose")
        if topic is not None:
            found.append(topic_poses(reader, topic, child, clock, str(path)))
    return found


def _frames(path: Path, topic: str, clock: Clock, origin: float, fps: float | None) -> Iterator[tuple[float, Image]]:
    with _opened(path) as reader:
        for k, (log, message) in enumerate(messages(reader, topic)):
            time = (log if clock == "log" else stamp(message)) - origin if fps is None else k / fps
            yield time, colour(message, f"{path}, image {k} of {topic}")


def _depths(path: Path, topic: str, clock: Clock, origin: float) -> Iterator[tuple[float, DepthImage]]:
    with _opened(path) as reader:
        for k, (log, message) in enumerate(messages(reader, topic)):
            yield (log if clock == "log" else stamp(message)) - origin, depth(message, f"{path}, image {k} of {topic}")


def _clock(wanted: Clock, asked: list[tuple[float, float]], path: Path) -> tuple[Clock, list[str]]:
    if wanted == "log" or all(header > 0 for _, header in asked):
        return wanted, []
    return "log", [f"{path.name}: pictures have no time in their header, so the time of writing is taken"]


def _topic(
    reader: Any, kinds: tuple[str, ...], wanted: str | None, path: Path, what: str, option: str, but: str | None = None
) -> str | None:
    """The topic that is wanted, or else the only one of these kinds, ``but`` aside; None if there is none."""
    known = sorted({c.topic for c in reader.connections if c.msgtype in kinds})
    if wanted is None:
        known = [t for t in known if t != but]
        named = [t for t in known if not t.startswith("/tf")] or known  # of transforms only if there is nothing else
        if len(named) > 1:
            raise InputError(f"{path} has {len(named)} {what} topics; choose with {option} one of {', '.join(named)}")
        return named[0] if named else None
    if wanted not in known:
        raise InputError(
            f"{path} has no {what} topic {wanted!r}; choose with {option} one of {', '.join(known) or 'none'}; all "
            f"topics: {_listed(reader)}"
        )
    return wanted


def _listed(reader: Any) -> str:
    return ", ".join(sorted({f"{c.topic} ({c.msgtype})" for c in reader.connections})) or "no topics"


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The bag, with whatever reading a damaged one raises as one line."""
    highlevel = library("rosbags.highlevel", "bags", "robotics")
    stores = library("rosbags.typesys", "bags", "robotics")
    # bags of older ROS 2 do not say what their messages consist of; the usual ones are the same in every version
    usual = stores.get_typestore(stores.Stores.ROS2_HUMBLE)
    try:
        with highlevel.AnyReader([path], default_typestore=usual) as reader:
            yield reader
    except InputError:
        raise
    except Exception as error:  # what it raises on a damaged bag depends on what is damaged
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise InputError(f"{path} cannot be read as a bag ({reason}); it is damaged or cut off") from error
