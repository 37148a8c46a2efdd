"""Image files, through OpenCV."""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..core.errors import InputError, MissingFileError, StoreError
from ..core.optional import library
from ..core.picture import DepthImage, Image

#: Most pixels a side of a texture; larger ones are shrunk.
LARGEST = 2048
#: Depth that a 16-bit file holds at most [m]; what is further away has this value.
DEEPEST = 65.535


def _cv2() -> Any:
    return library("cv2", "images", "perception")


def read_image(path: Path, size: tuple[int, int] | None = None) -> Image:
    """A picture ``(h, w, 3)``, red green blue.

    Args:
        path: of any format that OpenCV reads.
        size: width and height to scale it to; None: as it is, shrunk where it is larger than :data:`LARGEST`.

    Raises:
        MissingFileError, InputError: there is no such file, or it is no image.
    """
    cv2 = _cv2()
    if not path.is_file():
        raise MissingFileError(f"there is no image {path}")
    # not imread, which prints a warning of its own where a file is no image
    data = np.fromfile(path, np.uint8)
    read = cv2.imdecode(data, cv2.IMREAD_COLOR) if data.size else None
    if read is None:
        raise InputError(f"{path} cannot be read as an image; PNG and JPEG can")
    height, width = read.shape[:2]
    shrink = min(1.0, LARGEST / max(height, width))
    wanted = size or (max(1, round(width * shrink)), max(1, round(height * shrink)))
    if wanted != (width, height):
        smaller = wanted[0] * wanted[1] < width * height
        read = cv2.resize(read, wanted, interpolation=cv2.INTER_AREA if smaller else cv2.INTER_LINEAR)
    return np.ascontiguousarray(read[..., ::-1])


def write_image(path: Path, picture: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]) -> None:
    """Write a PNG: red green blue ``(h, w, 3)``, or one channel ``(h, w)``."""
    path.write_bytes(png(picture))


def png(picture: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]) -> bytes:
    """The bytes of a PNG: red green blue ``(h, w, 3)``, or one channel ``(h, w)``."""
    done, data = _cv2().imencode(".png", picture[..., ::-1] if picture.ndim == 3 else picture)
    if not done:
        raise StoreError(f"OpenCV cannot encode a picture of shape {picture.shape} as PNG")
    return bytes(data)


def millimetres(depth: DepthImage) -> npt.NDArray[np.uint16]:
    """Depth ``(H, W)`` [m] as whole millimetres, 0 where there is none, as depth cameras write it."""
    metres = np.where(np.isfinite(depth), np.minimum(depth, DEEPEST), 0.0)
    return np.asarray(np.rint(metres * 1000.0), np.uint16)
