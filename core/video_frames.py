"""Frames of a video store, read one at a time."""

import contextlib
import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import zarr

from .arrays import FloatArray
from .camera import Camera
from .errors import InputError, MissingFileError, MuslinError, StoreError
from .frames import Frames
from .picture import Image
from .store import damage, frame_of, open_store, subgroup, values


@contextlib.contextmanager
def _damage(path: Path) -> Iterator[None]:
    try:
        yield
    except MuslinError:
        raise
    except Exception as error:  # what zarr raises on a damaged store depends on what is damaged
        raise StoreError(f"{path} is damaged ({damage(error)}); import it again") from error


class VideoFrames:
    """The frames of a store of kind ``"video"``; only those that are asked for are read.

    Args:
        path: of the store.

    Raises:
        MissingFileError, InputError, StoreError: there is no store, it is no video, or it is damaged.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if path.is_file() or (path.is_dir() and not (path / "zarr.json").exists()):
            raise InputError(
                f"{path} is not a video store but a {'file' if path.is_file() else 'folder'}; make one of it with: "
                f"muslin import {path} -o {path.with_suffix('.zarr').name}"
            )
        if not path.exists():
            raise MissingFileError(f"there is no video store at {path}; muslin import makes one")
        root = open_store(path)
        if root.attrs.get("kind") != "video":
            raise InputError(f"{path} is not a video but {root.attrs.get('kind')!r}; make one with: muslin import")
        with _damage(path):
            names = cast(list[str], root.attrs["recordings"])
            self._groups = {name: subgroup(root, name) for name in names}
            self._rgb = {name: self._array(name) for name in names}

    def _array(self, name: str) -> zarr.Array[Any]:
        found = self._groups[name].get("rgb")
        if not isinstance(found, zarr.Array) or found.ndim != 4 or found.shape[3] != 3:
            raise InputError(f"{self.path}, video {name!r} is damaged (no pictures); import it again")
        return found

    @property
    def recordings(self) -> tuple[str, ...]:
        """Names of the takes."""
        return tuple(self._rgb)

    def count(self, recording: str) -> int:
        """Frames of a take."""
        return int(self._rgb[recording].shape[0])

    def size(self, recording: str) -> tuple[int, int]:
        """Width and height of a take's frames [px]."""
        _, height, width, _ = self._rgb[recording].shape
        return int(width), int(height)

    def time(self, recording: str) -> float:
        """From the first to the last frame of a take [s]."""
        times = self._times(recording)
        return float(times[-1] - times[0])

    def _times(self, recording: str) -> FloatArray:
        with _damage(self.path):
            return values(self._groups[recording], "time")

    def rgb(self, recording: str, number: int) -> Image:
        """One picture ``(H, W, 3)``."""
        with _damage(self.path):
            return frame_of(self._rgb[recording], number).astype(np.uint8, copy=False)

    def some(self, recording: str, numbers: Sequence[int]) -> Frames:
        """Some frames of a take with all their layers, in that order; at least one."""
        group = self._groups[recording]
        with _damage(self.path):
            table = cast(dict[str, Any] | None, group.attrs.get("camera"))
            layers = [
                np.stack([frame_of(array, k) for k in numbers]) if isinstance(array, zarr.Array) else None
                for array in (group.get(name) for name in ("rgb", "depth", "robot"))
            ]
        rgb, depth, robot = layers
        return Frames(cast(Image, rgb), depth, robot, None if table is None else Camera.from_table(table))

    def fingerprint(self, recording: str) -> str:
        """Tells a take from others, whatever its name: 16 hexadecimal digits of its size, times and first picture."""
        digest = hashlib.sha256(repr(self._rgb[recording].shape).encode())
        digest.update(np.ascontiguousarray(self._times(recording), "<f8").tobytes())
        digest.update(np.ascontiguousarray(self.rgb(recording, 0)).tobytes())
        return digest.hexdigest()[:16]
