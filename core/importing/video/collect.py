"""Frames of a take, read one after the other, each put right before the next is read."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...arrays import BoolArray, FloatArray
from ...errors import InputError
from ...frames import Frames
from ...lens import Lens
from ...picture import DepthImage, Image
from . import pictures
from .options import VideoOptions
from .raw import RawVideo

#: A depth picture this far from a frame in time is not of it [s].
_APART = 0.05
#: Most that the pictures of one take may need [bytes].
MOST = 4 << 30


@dataclass(frozen=True, eq=False)
class Collected:
    """The wanted frames of a take ``(T,)``, their times [s] ``(T,)``, and what a person should know of them."""

    time: FloatArray
    frames: Frames
    notes: tuple[str, ...]


def collect(raw: RawVideo, options: VideoOptions, lens: Lens | None) -> Collected:
    """Read the frames between ``options.start`` and ``options.stop``, undistort and scale them.

    Raises:
        InputError: frames differ in size, do not fit the camera or the layers, do not follow each other in time, or
            fewer than 2 of them are wanted.
    """
    start = -np.inf if options.start is None else options.start
    stop = np.inf if options.stop is None else options.stop
    if not start < stop:
        raise InputError(f"{raw.where}: start must be before stop, but start = {start:g} s and stop = {stop:g} s")
    kept = _Kept(raw, options, lens)
    first = last = np.nan
    size: tuple[int, ...] | None = None
    count = 0
    for time, picture in raw.frames():
        if time <= last:
            raise InputError(
                f"{raw.where}: time must rise, but frame {count} at {time:g} s follows one at {last:g} s; if its times "
                "cannot be trusted, give the rate of the camera with --fps, or of a bag --clock log"
            )
        if size is not None and picture.shape != size:
            raise InputError(
                f"{raw.where}: frame {count} has {picture.shape[1]} x {picture.shape[0]} pixels, but those before "
                f"have {size[1]} x {size[0]}; frames of one take must share a size"
            )
        first, last, size = (time if count == 0 else first), time, picture.shape
        if time > stop and not (raw.depth or raw.robot):
            break
        if start <= time <= stop:
            kept.add(count, time, picture)
        count += 1
    if len(kept.time) < 2:
        asked = "" if options.start is None and options.stop is None else f" between {start:g} and {stop:g} s"
        span = f"; its frames go from {first:g} to {last:g} s" if count else ""
        raise InputError(f"{raw.where} has {len(kept.time)} frame(s){asked}, at least 2 are needed{span}")
    for layer, files in (("depth", raw.depth), ("robot", raw.robot)):
        if files and len(files) != count:
            raise InputError(
                f"{raw.where} has {count} frames, but there are {len(files)} pictures of {layer} in {files[0].parent}; "
                "there must be one a frame"
            )
    return kept.made()


class _Kept:
    """The frames that are wanted, as far as they have come."""

    def __init__(self, raw: RawVideo, options: VideoOptions, lens: Lens | None) -> None:
        self._raw, self._size, self._lens = raw, options.size, lens
        self.time: list[float] = []
        self._rgb: list[Image] = []
        self._depth: list[DepthImage] = []
        self._robot: list[BoolArray] = []
        self._bytes = 0
        self._deep = None if raw.depths is None else _Deep(raw.depths())

    def add(self, number: int, time: float, picture: Image) -> None:
        height, width = picture.shape[:2]
        lens = self._lens
        if lens is not None and (lens.camera.width, lens.camera.height) != (width, height):
            raise InputError(
                f"{self._raw.where} has frames of {width} x {height} pixels, but the camera takes pictures of "
                f"{lens.camera.width} x {lens.camera.height}; give the camera of these frames (--size scales both)"
            )
        size = self._size or (width, height)
        layers: list[Image | DepthImage | BoolArray] = [picture]
        if file := self._file(self._raw.depth, number):
            layers.append(_of_size(pictures.millimetres(file.read_bytes(), str(file)), file, width, height))
            self._depth.append(self._right(layers[-1], size))
        if self._deep is not None:
            layers.append(_of_size(self._deep.at(time, height, width), "the depth topic", width, height))
            self._depth.append(self._right(layers[-1], size))
        if file := self._file(self._raw.robot, number):
            layers.append(_of_size(pictures.mask(file), file, width, height))
            self._robot.append(self._right(layers[-1], size))
        self._rgb.append(self._right(picture, size))
        self.time.append(time)
        self._bytes += size[0] * size[1] * sum(layer.itemsize * (layer.ndim == 3 or 1) for layer in layers)
        if self._bytes > MOST:
            raise InputError(
                f"{self._raw.where}: the pictures up to {time:.3g} s fill {MOST >> 30} GiB of memory; scale them with "
                "--size, or take a part with --start and --stop"
            )

    def _file(self, files: tuple[Path, ...], number: int) -> Path | None:
        return files[number] if number < len(files) else None

    def _right(self, picture: Image | DepthImage | BoolArray, size: tuple[int, int]) -> "np.ndarray[tuple[int, ...]]":
        return pictures.resized(picture if self._lens is None else self._lens.undistorted(picture), size)

    def made(self) -> Collected:
        rgb = np.stack(self._rgb)
        height, width = rgb.shape[1:3]
        camera = None if self._lens is None else self._lens.camera.scaled(width, height)
        notes = []
        if bool((rgb[..., :1] == rgb[..., 1:]).all()):
            notes.append("greyscale: an extractor that tells things by their colour will find nothing")
        if self._lens is not None and self._lens.distortion.any():
            notes.append("undistorted; the camera is a pinhole camera from here on")
        depth = np.stack(self._depth) if self._depth else None
        if depth is not None and (holes := float(np.isnan(depth).mean())):
            notes.append(f"{holes:.1%} of the depth are holes (NaN)")
        if self._deep is not None and self._deep.missed:
            notes.append(f"{self._deep.missed} frames have no depth within {_APART:g} s, so all of theirs are holes")
        robot = np.stack(self._robot) if self._robot else None
        return Collected(np.array(self.time), Frames(rgb, depth, robot, camera), tuple(notes))


class _Deep:
    """The depth picture that is nearest in time, asked for at rising times; both are read once."""

    def __init__(self, pictures: Iterator[tuple[float, DepthImage]]) -> None:
        self._rest = pictures
        self._now = next(pictures, None)
        self._next = next(pictures, None)
        self.missed = 0

    def at(self, time: float, height: int, width: int) -> DepthImage:
        """Depth ``(H, W)`` [m] at a time [s]; all holes where none is near."""
        while (
            self._now is not None and self._next is not None and abs(self._next[0] - time) <= abs(self._now[0] - time)
        ):
            self._now, self._next = self._next, next(self._rest, None)
        if self._now is not None and abs(self._now[0] - time) <= _APART:
            return self._now[1]
        self.missed += 1
        return np.full((height, width), np.nan, np.float32)


def _of_size(
    layer: "np.ndarray[tuple[int, ...]]", file: Path | str, width: int, height: int
) -> "np.ndarray[tuple[int, ...]]":
    if layer.shape != (height, width):
        raise InputError(
            f"{file} has {layer.shape[1]} x {layer.shape[0]} pixels, but its frame has {width} x {height}; both must "
            "be of one camera"
        )
    return layer
