"""From a file or folder to videos: choose the reader, then put frames, camera, poses and clocks right."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from ...errors import InputError, MissingFileError
from ...frames import Video
from ...lens import Lens
from ...motion import Motion
from ..axes import TURNS
from ..gripper import read_gripper_csv, to_motion
from ..raw import RawGripper
from ..units import METRES, unit_named
from .bag import is_bag, read_bag
from .clock import aligned, doubtful_offset
from .collect import collect
from .folder import picture_files, read_folder
from .lerobot import is_lerobot, read_lerobot
from .options import VideoOptions
from .raw import RawVideo
from .stream import read_stream
from .times import EPOCH

#: What video files end in.
SUFFIXES = (".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi", ".mpg", ".mpeg", ".mjpeg", ".ts")


def is_video(path: Path) -> bool:
    """Whether a file or folder is imported as a video; it need not be there."""
    return path.is_dir() or path.suffix.lower() in SUFFIXES or is_bag(path)


def import_video(path: Path, options: VideoOptions | None = None) -> list[tuple[Video, tuple[str, ...]]]:
    """Videos of one file or folder, each with what to tell of it; only LeRobot data sets hold several.

    Args:
        path: a video file, a folder of pictures, a LeRobot data set, an MCAP file or a ROS bag.
        options: what a person says about it.

    Raises:
        MissingFileError: the file, or one that an option names, does not exist.
        InputError: the file cannot be right; says where and what would be.
        BrokenPluginError: a library that reads it is not installed.
    """
    options = options or VideoOptions()
    _check(path, options)
    lens = None if options.camera is None else Lens.load(options.camera)
    takes = _reader(path)(path, options)
    if len(takes) > 1 and options.name is not None:
        raise InputError(f"{path} holds {len(takes)} takes with names of their own; leave --name out")
    return [_video(take, options, lens) for take in takes]


def _reader(path: Path) -> Callable[[Path, VideoOptions], list[RawVideo]]:
    if is_lerobot(path):
        return read_lerobot
    if is_bag(path):
        return read_bag
    return read_folder if path.is_dir() else read_stream


def _check(path: Path, options: VideoOptions) -> None:
    if not path.exists():
        raise MissingFileError(f"there is no file or folder {path}")
    if options.up not in TURNS:
        raise InputError(f"--up must be x, y or z, but is {options.up!r}")
    if options.gripper is not None and not options.gripper.is_file():
        raise MissingFileError(f"there is no file {options.gripper}")
    if options.fps is not None and not 0.1 <= options.fps <= 10_000:
        raise InputError(f"--fps must be 0.1 to 10000 frames a second, but is {options.fps:g}")
    if options.size is not None and not all(1 <= n <= 8192 for n in options.size):
        raise InputError(f"--size must be 1 to 8192 pixels a side, but is {options.size[0]} x {options.size[1]}")
    if options.depth_topic is not None and options.depth is not None:
        raise InputError("give --depth or --depth-topic, not both")
    if is_lerobot(path) and options.depth_topic is not None:
        raise InputError(f"--depth-topic goes with a bag, which {path} is not")
    if not (is_lerobot(path) or is_bag(path)):
        own = {"--image": options.image, "--pose": options.pose, "--pose-columns": options.pose_columns}
        own |= {"--take": options.takes, "--depth-topic": options.depth_topic}
        if wrong := [name for name, value in own.items() if value]:
            raise InputError(f"{wrong[0]} goes with a LeRobot data set or a bag, which {path} is not")


def _video(raw: RawVideo, options: VideoOptions, lens: Lens | None) -> tuple[Video, tuple[str, ...]]:
    if options.depth is not None:
        raw = replace(raw, depth=picture_files(options.depth))
    if options.robot is not None:
        raw = replace(raw, robot=picture_files(options.robot))
    name = options.name or raw.name
    gripper = _gripper(raw, options, name)
    got = collect(raw, options, lens or raw.lens)
    try:
        video = Video(name, got.time, got.frames, gripper, options.motion or "", options.load or 0.0)
    except InputError as error:
        raise InputError(f"{raw.where}: {error}") from error
    video, told = aligned(video, options.offset, raw.where)
    doubt = doubtful_offset(video) if options.offset is not None else ""
    return video, (*raw.notes, *got.notes, *told, *([doubt] if doubt else []))


def _gripper(raw: RawVideo, options: VideoOptions, name: str) -> Motion | None:
    unit = unit_named(options.unit, "--unit") if options.unit else "m"
    if unit not in METRES:
        raise InputError("--unit is that of the gripper poses beside a video: m, cm or mm")
    if options.gripper is None:
        return None if raw.gripper is None else to_motion(raw.gripper, unit, options.up, raw.where)
    poses = read_gripper_csv(options.gripper, name)
    if raw.origin and poses.times[0] > EPOCH:  # both count from 1970
        poses = RawGripper(poses.times - raw.origin, poses.poses)
    return to_motion(poses, unit, options.up, str(options.gripper))
