"""Picture files: colour, depth in millimetres, masks."""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...arrays import BoolArray
from ...errors import InputError
from ...optional import library
from ...picture import DepthImage, Image


def opencv() -> Any:
    """OpenCV, or an error that says how to install it."""
    return library("cv2", "pictures", "perception")


def colour(data: bytes, where: str) -> Image:
    """A picture ``(H, W, 3)``, red green blue, of the bytes of a file; greyscale gives three equal channels.

    Raises:
        InputError: it is no picture, or one of 16 bits.
    """
    cv2 = opencv()
    read = _decoded(data, cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH, where)
    if read.dtype != np.uint8:
        raise InputError(
            f"{where} has {8 * read.dtype.itemsize} bits a channel, colour has 8; if it is depth, give its folder with "
            "--depth"
        )
    return np.ascontiguousarray(read[..., ::-1])


def millimetres(data: bytes, where: str) -> DepthImage:
    """Depth ``(H, W)`` [m] of the bytes of a 16-bit greyscale file in millimetres; NaN where it has 0, a hole.

    Raises:
        InputError: it is no such picture.
    """
    read = _decoded(data, opencv().IMREAD_UNCHANGED, where)
    if read.dtype != np.uint16 or read.ndim != 2:
        channels = 1 if read.ndim == 2 else read.shape[2]
        raise InputError(
            f"{where}: depth must be greyscale of 16 bits in millimetres, but it has {channels} channel(s) of "
            f"{8 * read.dtype.itemsize} bits"
        )
    return np.where(read > 0, read.astype(np.float32) / np.float32(1000.0), np.float32(np.nan))


def mask(path: Path) -> BoolArray:
    """A mask ``(H, W)``: true where any channel is not zero."""
    read = _decoded(path.read_bytes(), opencv().IMREAD_UNCHANGED, str(path))
    return np.asarray(read > 0 if read.ndim == 2 else (read[..., :3] > 0).any(axis=2))


def resized(picture: npt.NDArray[Any], size: tuple[int, int]) -> npt.NDArray[Any]:
    """A picture scaled to width and height; colours are averaged, depth and masks take the nearest pixel."""
    if picture.shape[1::-1] == size:
        return picture
    cv2 = opencv()
    smaller = size[0] * size[1] < picture.shape[0] * picture.shape[1]
    how = (cv2.INTER_AREA if smaller else cv2.INTER_LINEAR) if picture.dtype == np.uint8 else cv2.INTER_NEAREST_EXACT
    plain = picture.astype(np.uint8) if picture.dtype == bool else picture
    return np.asarray(cv2.resize(plain, size, interpolation=how).astype(picture.dtype))


def _decoded(data: bytes, flags: int, where: str) -> npt.NDArray[Any]:
    raw = np.frombuffer(data, np.uint8)
    read = opencv().imdecode(raw, flags) if raw.size else None
    if read is None:
        raise InputError(f"{where} cannot be read as a picture; it is empty, damaged or no PNG or JPEG")
    return np.asarray(read)
