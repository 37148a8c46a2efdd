"""MCAP files and ROS bags, through rosbags, which reads those of ROS 2 (MCAP, SQLite) and of ROS 1 without ROS."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...optional import library
from ...picture import Image
from ..raw import RawGripper
from . import pictures
from .options import Clock, VideoOptions
from .raw import RawVideo

_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_POSES = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped", "tf2_msgs/msg/TFMessage")
#: Encoding of a raw image -> channels, and which of them are red, green and blue.
_ENCODINGS = {
    "rgb8": (3, [0, 1, 2]),
    "bgr8": (3, [2, 1, 0]),
    "rgba8": (4, [0, 1, 2]),
    "bgra8": (4, [2, 1, 0]),
    "mono8": (1, [0, 0, 0]),
    "8UC1": (1, [0, 0, 0]),
    "8UC3": (3, [2, 1, 0]),
}
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
        topic = _topic(reader, _IMAGES, options.image, path, "image", "--image")
        if topic is None:
            raise InputError(f"{path} has no topic with images; it has {_listed(reader)}")
        asked = []
        for k, (log, message) in enumerate(_messages(reader, topic)):
            if k == _ASKED:
                break
            asked.append((log, _header(message)))
        if not asked:
            raise InputError(f"{path}: topic {topic} holds no messages")
        clock, notes = _clock(options.clock, asked, path)
        gripper, delay = None, None
        if options.pose != "none" and options.gripper is None:
            wanted, _, child = (options.pose or "").partition(":")
            pose = _topic(reader, _POSES, wanted or None, path, "pose", "--pose")
            if pose is not None:
                gripper, delay, said = _gripper(reader, pose, child, clock, path)
                notes += said
    origin = asked[0][0 if clock == "log" else 1]
    if gripper is not None:
        gripper = RawGripper(gripper.times - origin, gripper.poses)
    if clock == "header":
        own = float(np.median([log - header for log, header in asked]))
        notes.append(f"pictures have the time of their header, {own:.3f} s before they were written")
        if delay is not None and abs(delay - own) > _TWO_CLOCKS:
            notes.append(
                f"headers of poses lie {delay:.3f} s before they were written, which are two clocks; --clock log takes "
                "the time of writing"
            )
    notes.append(f"time 0 is {origin:.3f} s in the bag")
    frames = partial(_frames, path, topic, clock, origin, options.fps)
    return [RawVideo(str(path), path.stem, frames, gripper=gripper, origin=origin, notes=tuple(notes))]


def _frames(path: Path, topic: str, clock: Clock, origin: float, fps: float | None) -> Iterator[tuple[float, Image]]:
    with _opened(path) as reader:
        for k, (log, message) in enumerate(_messages(reader, topic)):
            time = (log if clock == "log" else _header(message)) - origin if fps is None else k / fps
            yield time, _picture(message, f"{path}, image {k} of {topic}")


def _picture(message: Any, where: str) -> Image:
    if not hasattr(message, "encoding"):
        return pictures.colour(bytes(message.data), where)
    if message.encoding not in _ENCODINGS:
        raise InputError(f"{where} has encoding {message.encoding!r}; pictures may have {', '.join(_ENCODINGS)}")
    channels, order = _ENCODINGS[message.encoding]
    data = np.asarray(message.data, np.uint8)
    if message.step < message.width * channels or data.size < message.step * message.height or not data.size:
        raise InputError(f"{where} is damaged: {data.size} bytes for {message.width} x {message.height} pixels")
    rows = data[: message.step * message.height].reshape(message.height, message.step)
    pixels = rows[:, : message.width * channels].reshape(message.height, message.width, channels)
    return np.ascontiguousarray(pixels[..., order])


def _gripper(reader: Any, topic: str, child: str, clock: Clock, path: Path) -> tuple[RawGripper, float, list[str]]:
    """Poses of a topic [s of the bag], the median delay of their headers [s], and the frame that they are in."""
    times, poses, delays, frames, children = [], [], [], set(), set()
    for log, message in _messages(reader, topic):
        for part in getattr(message, "transforms", [message]):
            own = getattr(part, "child_frame_id", "")
            children.add(own)
            if child and own != child:
                continue
            header = _header(part)
            place, turn = (
                (part.pose.position, part.pose.orientation)
                if hasattr(part, "pose")
                else (
                    part.transform.translation,
                    part.transform.rotation,
                )
            )
            times.append(log if clock == "log" else header)
            delays.append(log - header)
            poses.append([place.x, place.y, place.z, turn.w, turn.x, turn.y, turn.z])
            frames.add((part.header.frame_id, own))
    if not child and len(children) > 1:
        raise InputError(
            f"{path}: {topic} holds poses of {', '.join(sorted(children))}; say --pose {topic}:FRAME or --pose none"
        )
    if not poses:
        what = f" of frame {child!r}; it has {', '.join(sorted(children))}" if child else ""
        raise InputError(f"{path}: topic {topic} holds no poses{what}")
    if clock == "header" and min(t for t in times) <= 0:
        raise InputError(f"{path}: poses of {topic} have no time in their header; say --clock log")
    order = np.argsort(np.array(times), kind="stable")
    told = ", ".join(sorted({f"{parent!r}" for parent, _ in frames}))
    return (
        RawGripper(np.array(times)[order], np.array(poses)[order][:, None]),
        float(np.median(delays)),
        [f"gripper poses of {topic}{f':{child}' if child else ''} in frame {told}, which must be that of the camera"],
    )


def _clock(wanted: Clock, asked: list[tuple[float, float]], path: Path) -> tuple[Clock, list[str]]:
    if wanted == "log" or all(header > 0 for _, header in asked):
        return wanted, []
    return "log", [f"{path.name}: pictures have no time in their header, so the time of writing is taken"]


def _topic(reader: Any, kinds: tuple[str, ...], wanted: str | None, path: Path, what: str, option: str) -> str | None:
    known = sorted({c.topic for c in reader.connections if c.msgtype in kinds})
    if wanted is None:
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


def _messages(reader: Any, topic: str) -> Iterator[tuple[float, Any]]:
    """Time of writing [s] and content of every message of a topic."""
    for connection, nanoseconds, raw in reader.messages([c for c in reader.connections if c.topic == topic]):
        yield 1e-9 * nanoseconds, reader.deserialize(raw, connection.msgtype)


def _header(message: Any) -> float:
    return float(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)


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
