"""Messages of a bag: those of a topic, one after the other, and what one of pictures shows."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from ...errors import InputError
from ...picture import DepthImage, Image
from . import pictures

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
#: Encoding of a raw depth image -> type of a pixel, and metres of its unit (REP 118).
_DEPTHS = {"16UC1": ("u2", 0.001), "mono16": ("u2", 0.001), "32FC1": ("f4", 1.0)}
#: What stands before the PNG of a compressed depth image [bytes] (compressed_depth_image_transport).
_DEPTH_HEADER = 12


def messages(reader: Any, topic: str) -> Iterator[tuple[float, Any]]:
    """Time of writing [s] and content of every message of a topic."""
    for connection, nanoseconds, raw in reader.messages([c for c in reader.connections if c.topic == topic]):
        yield 1e-9 * nanoseconds, reader.deserialize(raw, connection.msgtype)


def stamp(message: Any) -> float:
    """Time of the header [s]."""
    return float(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)


def colour(message: Any, where: str) -> Image:
    """A picture ``(H, W, 3)``.

    Raises:
        InputError: it is damaged, or of an encoding that is no picture.
    """
    if not hasattr(message, "encoding"):
        return pictures.colour(bytes(message.data), where)
    if message.encoding not in _ENCODINGS:
        deep = "; depth is taken with --depth-topic" if message.encoding in _DEPTHS else ""
        raise InputError(f"{where} has encoding {message.encoding!r}; pictures may have {', '.join(_ENCODINGS)}{deep}")
    channels, order = _ENCODINGS[message.encoding]
    pixels = _rows(message, channels, where).reshape(message.height, message.width, channels)
    return np.ascontiguousarray(pixels[..., order])


def depth(message: Any, where: str) -> DepthImage:
    """Depth ``(H, W)`` [m], NaN for holes (0, or what is not finite).

    Raises:
        InputError: it is damaged, or of an encoding that is no depth.
    """
    if not hasattr(message, "encoding"):
        kind = message.format.partition(";")[0].strip()
        if kind != "16UC1" or "png" not in message.format:
            raise InputError(f"{where} has format {message.format!r}; compressed depth must be 16UC1 in PNG")
        return pictures.millimetres(bytes(message.data)[_DEPTH_HEADER:], where)
    if message.encoding not in _DEPTHS:
        raise InputError(f"{where} has encoding {message.encoding!r}; depth may have {', '.join(_DEPTHS)}")
    kind, unit = _DEPTHS[message.encoding]
    stored = np.dtype(kind).newbyteorder(">" if message.is_bigendian else "<")
    raw = np.ascontiguousarray(_rows(message, stored.itemsize, where)).view(stored)
    metres = raw.reshape(message.height, message.width).astype(np.float32) * np.float32(unit)
    return np.where(np.isfinite(metres) & (metres > 0), metres, np.float32(np.nan))


def _rows(message: Any, wide: int, where: str) -> npt.NDArray[np.uint8]:
    """Bytes ``(H, W * wide)`` of the pixels, each of ``wide`` bytes, without what pads a row."""
    data = np.asarray(message.data, np.uint8)
    if message.step < message.width * wide or data.size < message.step * message.height or not data.size:
        raise InputError(f"{where} is damaged: {data.size} bytes for {message.width} x {message.height} pixels")
    return data[: message.step * message.height].reshape(message.height, message.step)[:, : message.width * wide]
