"""A camera with the distortion of its lens, and pictures without it."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .arrays import FloatArray
from .camera import Camera, read_camera_file, write_camera_file
from .errors import InputError
from .optional import library

#: How many coefficients OpenCV's models of distortion have.
COUNTS = (0, 4, 5, 8, 12, 14)


@dataclass(frozen=True, eq=False)
class Lens:
    """A camera as it was calibrated: frames of it are undistorted once, and from then on a pinhole camera took them.

    Args:
        camera: the pinhole camera.
        distortion: coefficients k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx ty]]]]; none for a lens without.

    References:
        OpenCV, "Camera Calibration and 3D Reconstruction", distortion coefficients.
    """

    camera: Camera
    distortion: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if self.distortion.ndim != 1 or len(self.distortion) not in COUNTS:
            raise InputError(
                f"distortion must have {', '.join(map(str, COUNTS[1:-1]))} or {COUNTS[-1]} coefficients "
                f"(k1 k2 p1 p2 k3 ...), but has {self.distortion.size}"
            )

    @classmethod
    def load(cls, path: Path) -> "Lens":
        """Read a camera file; its key ``distortion`` may be left out.

        Raises:
            MissingFileError: there is none.
            InputError: it is not one; the message names the key.
        """
        table = read_camera_file(path)
        try:
            return cls(Camera.from_table(table), np.asarray(table.get("distortion", []), float))
        except InputError as error:
            raise InputError(f"camera file {path}: {error}") from error

    def save(self, path: Path) -> None:
        """Write a camera file, JSON if its name ends so, else TOML."""
        distortion = {"distortion": self.distortion.tolist()} if self.distortion.size else {}
        write_camera_file(path, self.camera.as_table() | distortion)

    @property
    def matrix(self) -> FloatArray:
        """The camera matrix ``(3, 3)`` [px]."""
        c = self.camera
        return np.array([[c.fx, 0.0, c.cx], [0.0, c.fy, c.cy], [0.0, 0.0, 1.0]])

    def undistorted(self, picture: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """A picture ``(H, W)`` or ``(H, W, 3)`` as the pinhole camera would have taken it.

        Colours are interpolated. Depth (float) and masks (bool) take the nearest pixel, so that no value is made up
        between an object and what is behind it; what the lens did not see is black, NaN or false.
        """
        if not self.distortion.any():
            return picture
        cv2 = library("cv2", "distorted pictures", "perception")
        colour = picture.dtype == np.uint8
        plain = picture.astype(np.uint8) if picture.dtype == bool else picture
        edge = np.nan if picture.dtype.kind == "f" else 0
        how = cv2.INTER_LINEAR if colour else cv2.INTER_NEAREST
        made = cv2.remap(plain, *self._maps, how, borderMode=cv2.BORDER_CONSTANT, borderValue=edge)
        return np.asarray(made.astype(picture.dtype))

    def undistorted_points(self, pixels: FloatArray) -> FloatArray:
        """Points ``(..., 2)`` [px] where the pinhole camera would have seen them; NaN stays NaN."""
        if not self.distortion.any() or not pixels.size:
            return pixels
        cv2 = library("cv2", "distorted points", "perception")
        flat = np.ascontiguousarray(pixels, float).reshape(-1, 1, 2)
        return np.asarray(cv2.undistortPoints(flat, self.matrix, self.distortion, P=self.matrix), float).reshape(
            pixels.shape
        )

    @cached_property
    def _maps(self) -> tuple[Any, Any]:
        cv2 = library("cv2", "distorted pictures", "perception")
        size = (self.camera.width, self.camera.height)
        one, two = cv2.initUndistortRectifyMap(self.matrix, self.distortion, None, self.matrix, size, cv2.CV_32FC1)
        return one, two
