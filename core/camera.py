"""A pinhole camera in OpenCV's convention, and its file."""

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from .arrays import FloatArray
from .errors import InputError, MissingFileError
from .motion import IDENTITY_POSE, inverse, quaternion_of, rotate
from .store import write_text

#: Horizontal field of view where none is asked for [rad].
FIELD_OF_VIEW = 0.8


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera without lens distortion: x right, y down, z forward.

    Pixel (0, 0) is the centre of the upper left pixel, so a picture covers -0.5 to width - 0.5.

    Args:
        width, height: of the picture [px].
        fx, fy: focal lengths [px].
        cx, cy: principal point [px]; (width - 1) / 2 is the middle.
        pose: of the camera in the world: position [m] and quaternion w x y z ``(7,)``.

    References:
        OpenCV, "Camera Calibration and 3D Reconstruction", pinhole camera model.
    """

    width: int = 320
    height: int = 320
    fx: float = 400.0
    fy: float = 400.0
    cx: float = 159.5
    cy: float = 159.5
    pose: FloatArray = field(default_factory=IDENTITY_POSE.copy)

    def __post_init__(self) -> None:
        if not (1 <= self.width <= 8192 and 1 <= self.height <= 8192):
            raise InputError(f"a camera's picture must be 1 to 8192 pixels a side, not {self.width} x {self.height}")
        if not (np.isfinite([self.fx, self.fy, self.cx, self.cy]).all() and self.fx > 0 and self.fy > 0):
            raise InputError(
                f"a camera needs focal lengths above zero and a finite principal point, got fx = {self.fx:g}, "
                f"fy = {self.fy:g}, cx = {self.cx:g}, cy = {self.cy:g}"
            )
        if self.pose.shape != (7,) or not np.isfinite(self.pose).all():
            raise InputError("a camera's pose must be 7 finite numbers: x y z [m] and a quaternion w x y z")
        length = float(np.linalg.norm(self.pose[3:]))
        if abs(length - 1.0) > 1e-3:
            raise InputError(f"a camera's quaternion (w x y z) must have length 1, but has {length:.4g}")
        if abs(length - 1.0) > 1e-12:  # written with few digits
            object.__setattr__(self, "pose", np.concatenate([self.pose[:3], self.pose[3:] / length]))

    @classmethod
    def look_at(
        cls,
        eye: FloatArray,
        target: FloatArray,
        *,
        field_of_view: float = FIELD_OF_VIEW,
        width: int = 320,
        height: int = 320,
    ) -> "Camera":
        """A camera at ``eye (3,)`` [m] with ``target (3,)`` [m] in the middle, upright.

        Args:
            field_of_view: horizontal [rad].
            width, height: of the picture [px].
        """
        ahead = np.asarray(target, float) - np.asarray(eye, float)
        if not np.linalg.norm(ahead) > 0:
            raise InputError("a camera cannot look at the place where it is")
        if not 0.0 < field_of_view < np.pi:
            raise InputError(f"a field of view must lie between 0 and pi rad, but is {field_of_view:g}")
        pose = np.concatenate([np.asarray(eye, float), _towards(ahead)])
        focal = 0.5 * width / np.tan(0.5 * field_of_view)
        return cls(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2, pose)

    @classmethod
    def framing(
        cls,
        points: FloatArray,
        *,
        direction: tuple[float, float, float] = (-0.5, 0.8, -0.5),
        field_of_view: float = FIELD_OF_VIEW,
        width: int = 320,
        height: int = 320,
        margin: float = 1.15,
    ) -> "Camera":
        """A camera that has all of ``points (..., 3)`` [m] in the picture.

        Args:
            points: what must be seen, as the vertices of every frame.
            direction: in which it looks, in the world.
            field_of_view: horizontal [rad].
            width, height: of the picture [px].
            margin: how much wider the view is than it need be [1].
        """
        turn = _towards(np.asarray(direction, float))
        x, y, z = rotate(inverse(turn), np.asarray(points, float).reshape(-1, 3)).T
        eye = np.empty(3)
        depths = []
        for axis, (across, half) in enumerate(((x, 1.0), (y, height / width))):
            # seen from e a point is inside if |across - e_across| <= half (z - e_z): two cones, e is where they meet
            half *= np.tan(0.5 * field_of_view) / margin
            one, other = float((z - across / half).min()), float((z + across / half).min())
            eye[axis] = 0.5 * half * (other - one)
            depths.append(0.5 * (one + other))
        eye[2] = min(*depths, float(z.min()) - 0.05)
        focal = 0.5 * width / np.tan(0.5 * field_of_view)
        pose = np.concatenate([rotate(turn, eye), turn])
        return cls(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2, pose)

    def local(self, points: FloatArray) -> FloatArray:
        """``points (..., 3)`` [m] of the world in the camera's frame."""
        return rotate(inverse(self.pose[3:]), points - self.pose[:3])

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pixels ``(..., 2)`` and depth along the optical axis ``(...,)`` [m] of ``points (..., 3)`` [m].

        Points that are not in front of the camera have NaN pixels.
        """
        local = self.local(points)
        depth = local[..., 2]
        ahead = np.where(depth > 0, depth, np.nan)
        pixels = local[..., :2] / ahead[..., None] * [self.fx, self.fy] + [self.cx, self.cy]
        return np.asarray(pixels), np.asarray(depth)

    @cached_property
    def rays(self) -> FloatArray:
        """World directions ``(height, width, 3)`` through the pixel centres, of depth 1: eye + depth * ray."""
        u, v = np.meshgrid(np.arange(self.width), np.arange(self.height))
        local = np.stack([(u - self.cx) / self.fx, (v - self.cy) / self.fy, np.ones(u.shape)], axis=-1)
        return rotate(self.pose[3:], local)

    def as_table(self) -> dict[str, Any]:
        """What a camera file holds."""
        table = {k: getattr(self, k) for k in ("width", "height", "fx", "fy", "cx", "cy")}
        return table | {"position": self.pose[:3].tolist(), "quaternion": self.pose[3:].tolist()}

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> "Camera":
        """The camera of a table; an :class:`InputError` names the key that is wrong."""
        try:
            t = _File.model_validate(table)
        except ValidationError as error:
            wrong = [f"{'.'.join(map(str, e['loc'])) or 'the file'}: {e['msg']}" for e in error.errors()]
            raise InputError(f"{'; '.join(wrong)}. Keys: {', '.join(_File.model_fields)}") from error
        pose = np.array([*t.position, *t.quaternion])
        return cls(t.width, t.height, t.fx, t.fx if t.fy is None else t.fy, *t.middle(), pose)

    def save(self, path: Path) -> None:
        """Write a camera file, JSON if its name ends so, else TOML."""
        write_camera_file(path, self.as_table())

    def scaled(self, width: int, height: int) -> "Camera":
        """The camera of pictures that were scaled to ``width`` x ``height`` [px]: the same edges, other pixels."""
        a, b = width / self.width, height / self.height
        middle = ((self.cx + 0.5) * a - 0.5, (self.cy + 0.5) * b - 0.5)
        return Camera(width, height, self.fx * a, self.fy * b, *middle, self.pose)

    @classmethod
    def load(cls, path: Path) -> "Camera":
        """Read a camera file, leaving out the distortion of its lens; see :class:`~muslin.core.lens.Lens`.

        Raises:
            MissingFileError: there is none.
            InputError: it is not one; the message names the key.
        """
        table = read_camera_file(path)
        try:
            return cls.from_table(table)
        except InputError as error:
            raise InputError(f"camera file {path}: {error}") from error


def read_camera_file(path: Path) -> dict[str, Any]:
    """The keys of a camera file, not yet checked."""
    if not path.is_file():
        raise MissingFileError(f"there is no camera file {path}")
    try:
        text = path.read_text(encoding="utf-8")
        table = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except ValueError as error:  # of either format, and bytes that are no text
        raise InputError(f"camera file {path} cannot be read: {error}") from error
    if not isinstance(table, dict):
        raise InputError(f"camera file {path} must hold keys and values, as {', '.join(_File.model_fields)}")
    return table


def write_camera_file(path: Path, table: Mapping[str, Any]) -> None:
    """Write the keys of a camera file, as JSON if its name ends so, else as TOML."""
    write_text(path, json.dumps(table, indent=1) + "\n" if path.suffix == ".json" else tomli_w.dumps(table))


class _File(BaseModel):
    """The keys of a camera file."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    width: int = Field(default=320, strict=True)
    height: int = Field(default=320, strict=True)
    fx: float
    fy: float | None = None
    cx: float | None = None
    cy: float | None = None
    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    distortion: list[float] = []

    def middle(self) -> tuple[float, float]:
        """The principal point, in the middle of the picture where the file does not say."""
        cx = (self.width - 1) / 2 if self.cx is None else self.cx
        return cx, (self.height - 1) / 2 if self.cy is None else self.cy


def _towards(ahead: FloatArray) -> FloatArray:
    """The quaternion of an upright camera that looks along ``ahead (3,)``; north is up where that is vertical."""
    z = ahead / np.linalg.norm(ahead)
    up = np.array([0.0, 0.0, 1.0]) if abs(z[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    x = np.cross(z, up)
    x /= np.linalg.norm(x)
    return quaternion_of(np.stack([x, np.cross(z, x), z], axis=1))
