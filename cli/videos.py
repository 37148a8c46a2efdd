"""``muslin import`` of videos: frames to one store."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..core.errors import InputError
from ..core.frames import Video
from ..core.importing.video import VideoOptions, import_video, is_video
from ..core.importing.video.options import Clock
from ..core.video_store import save_videos
from .console import command, next_step, say
from .per_file import per_file


def all_videos(files: Sequence[Path]) -> bool:
    """Whether these are videos; some that are and some that are not are refused."""
    videos = [is_video(f) for f in files]
    if any(videos) and not all(videos):
        raise InputError(
            f"{files[videos.index(True)]} is a video and {files[videos.index(False)]} is not; import them apart"
        )
    return all(videos)


def import_videos(
    files: Sequence[Path],
    output: Path,
    unit: str | None,
    up: str,
    each: Mapping[str, Sequence[Any] | None],
    videos: Mapping[str, Any],
    takes: Sequence[str],
    force: bool,
) -> None:
    """Import ``files`` and say what they hold.

    Args:
        files, output, unit, up, takes, force: as of ``muslin import``.
        each: options that are given once, or once a file.
        videos: options of videos alone, by name as on the command line.
    """
    clock = videos["clock"] or "header"
    if clock not in ("header", "log"):
        raise InputError(f"--clock must be header or log, but is {clock!r}")
    options = VideoOptions(
        unit=unit,
        up=up,
        fps=videos["fps"],
        size=_size(videos["size"]),
        image=videos["image"],
        depth_topic=videos["depth-topic"],
        pose=tuple(videos["pose"] or ()),
        pose_columns=tuple(videos["pose-columns"] or ()),
        takes=tuple(takes),
        clock=cast(Clock, clock),
    )
    offsets = [_offset(text) for text in videos["offset"] or ["0"]]
    each = {**each, "depth": videos["depth"], "robot": videos["robot"], "offset": offsets}
    made: list[tuple[Video, tuple[str, ...]]] = []
    for file, own in zip(files, per_file(each, len(files)), strict=True):
        made += import_video(file, replace(options, **own))
    save_videos([video for video, _ in made], output, overwrite=force)
    say(f"wrote {output}")
    for video, notes in made:
        say("  " + summary(video))
        for note in notes:
            say("    " + note)
    next_step(command("extract", output, "--extractor", "NAME", "-o", "POINTS.zarr"), note="extractors: muslin plugins")


def summary(video: Video) -> str:
    """One line about a video."""
    frames, steps = video.frames, np.diff(video.time)
    count, height, width = frames.rgb.shape[:3]
    even = steps.max() < 1.5 * steps.min()
    rate = f"{1.0 / steps.mean():.4g} a second" if even else f"{steps.min():.3g} to {steps.max():.3g} s apart"
    parts = [f"{video.name}: {count} frames of {width} x {height} from {video.time[0]:g} to {video.time[-1]:g} s", rate]
    parts += [name for name, layer in (("depth", frames.depth), ("robot mask", frames.robot)) if layer is not None]
    parts.append("no camera" if frames.camera is None else "camera")
    parts.append("no gripper" if video.gripper is None else f"{video.gripper.grippers} gripper(s)")
    if video.load:
        parts.append(f"load {video.load:g} kg")
    return ", ".join(parts)


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise InputError(f"--size must be width and height in pixels as 320x240, but is {text!r}")
    return int(width), int(height)


def _offset(text: str) -> float | None:
    if text == "auto":
        return None
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise InputError(f"--offset must be seconds or auto, but is {text!r}")
    return value
