"""Folders of pictures: PNG or JPEG, one a frame; those that ``muslin render`` writes, too."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...arrays import FloatArray
from ...errors import InputError, MissingFileError
from ...lens import Lens
from ...picture import Image
from . import pictures
from .options import VideoOptions
from .raw import RawVideo
from .times import NAMES, read_times, since_first

_ENDINGS = (".png", ".jpg", ".jpeg")


def picture_files(folder: Path) -> tuple[Path, ...]:
    """The pictures of a folder in the order of their names, numbers by value: 9 before 10.

    Raises:
        MissingFileError, InputError: there is no such folder, or no picture in it.
    """
    if not folder.exists():
        raise MissingFileError(f"there is no folder {folder}")
    if not folder.is_dir():
        raise InputError(f"{folder} is a file; name the folder of the pictures")
    found = [p for p in folder.iterdir() if p.suffix.lower() in _ENDINGS and not p.name.startswith(".")]
    if not found:
        raise InputError(f"there are no pictures in {folder}; it must hold PNG or JPEG files, one a frame")
    return tuple(sorted(found, key=lambda p: [(int(x), "") if x.isdigit() else (0, x) for x in _parts(p.name)]))


def read_folder(path: Path, options: VideoOptions) -> list[RawVideo]:
    """The one take of a folder; ``rgb``, ``depth`` and ``camera.toml`` in it are taken for what they are named."""
    colour = path / "rgb" if (path / "rgb").is_dir() else path
    files = picture_files(colour)
    times, origin, said = _times((path, colour), len(files), options.fps)
    lens = Lens.load(path / "camera.toml") if options.camera is None and (path / "camera.toml").is_file() else None
    depth, robot = (
        picture_files(path / layer) if chosen is None and colour != path and (path / layer).is_dir() else ()
        for layer, chosen in (("depth", options.depth), ("robot", options.robot))
    )

    def frames() -> Iterator[tuple[float, Image]]:
        for time, file in zip(times, files, strict=True):
            yield float(time), pictures.colour(file.read_bytes(), str(file))

    return [RawVideo(str(path), path.absolute().name, frames, depth, robot, lens=lens, origin=origin, notes=said)]


def _times(folders: tuple[Path, ...], count: int, fps: float | None) -> tuple[FloatArray, float, tuple[str, ...]]:
    found = next((folder / name for folder in folders for name in NAMES if (folder / name).is_file()), None)
    if fps is not None:
        return np.arange(count) / fps, 0.0, (f"{found} is not read, --fps counts",) if found else ()
    if found is None:
        raise InputError(
            f"{folders[0]} does not say when its {count} pictures were taken; give --fps RATE, or put a file "
            f"{NAMES[0]} with one time in s a line beside them"
        )
    times = read_times(found)
    if len(times) != count:
        raise InputError(f"{found} has {len(times)} times for {count} pictures; each needs one")
    return *since_first(times), ()


def _parts(name: str) -> list[str]:
    return re.split(r"(\d+)", name)
