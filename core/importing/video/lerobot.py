"""LeRobot data sets, as they lie on disk: ``meta/info.json``, tables in Parquet, pictures in MP4 or in the tables.

References:
    huggingface/lerobot, formats v2.0 and v2.1 (a file an episode) and v3.0 (several episodes a file).
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import FloatArray
from ...errors import InputError
from ...picture import Image
from . import pictures
from .lerobot_files import LeRobotFiles
from .lerobot_pose import gripper_of
from .options import VideoOptions
from .raw import RawVideo
from .stream import stream_frames


def is_lerobot(path: Path) -> bool:
    """Whether a folder is such a data set."""
    return (path / "meta" / "info.json").is_file()


def read_lerobot(path: Path, options: VideoOptions) -> list[RawVideo]:
    """The chosen episodes as one camera saw them, with the gripper's poses.

    Raises:
        InputError: there is no such episode, camera, feature or column; the message lists those that there are.
    """
    files = LeRobotFiles(path)
    camera = _camera(files, options.image)
    takes = []
    for episode in files.episodes(options.takes):
        table = files.table(episode, camera)
        gripper, said = gripper_of(files, table, options) if options.gripper is None else (None, ())
        times = np.asarray(table["timestamp"], float)
        if options.fps is not None:
            times = np.arange(len(times)) / options.fps
        where = f"{path}, episode {episode.index}"
        if files.features[camera]["dtype"] == "video":
            frames = partial(_of_file, files.video(episode, camera), episode.begin(camera), times, files.fps, where)
        else:
            frames = partial(_of_table, table[camera], times, where)
        takes.append(RawVideo(where, episode.name, frames, gripper=gripper, notes=(f"camera {camera!r}", *said)))
    return takes


def _camera(files: LeRobotFiles, wanted: str | None) -> str:
    known = [key for key, feature in files.features.items() if feature.get("dtype") in ("video", "image")]
    if not known:
        raise InputError(f"{files.path} has no pictures, only {', '.join(files.features)}")
    if wanted is None and len(known) == 1:
        return known[0]
    if wanted not in known:
        what = f"no camera {wanted!r}" if wanted else f"{len(known)} cameras"
        raise InputError(f"{files.path} has {what}; choose with --image one of {', '.join(known)}")
    return wanted


def _of_file(path: Path, begin: float, times: FloatArray, fps: float, where: str) -> Iterator[tuple[float, Image]]:
    """The frames of one episode, which begins at ``begin`` [s] in a file that may hold others."""
    slack, count = 0.5 / fps, 0
    for time, picture in stream_frames(path, begin=max(0.0, begin - slack)):
        if time < begin - slack:
            continue
        if count == len(times):
            return
        yield float(times[count]), picture
        count += 1
    if count < len(times):
        raise InputError(
            f"{where}: the table has {len(times)} rows, but {path} has {count} frames of it; copy it again"
        )


def _of_table(cells: list[dict[str, Any]], times: FloatArray, where: str) -> Iterator[tuple[float, Image]]:
    for k, (time, cell) in enumerate(zip(times, cells, strict=True)):
        if not cell or not cell.get("bytes"):
            raise InputError(f"{where}: row {k} of the table holds no picture")
        yield float(time), pictures.colour(cell["bytes"], f"{where}, row {k}")
