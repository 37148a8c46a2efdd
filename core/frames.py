"""Frames: what a camera gave of one take, and the take itself."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .arrays import BoolArray, FloatArray
from .camera import Camera
from .errors import InputError
from .measurement import check_name
from .motion import Motion
from .picture import DepthImage, Image


@dataclass(frozen=True, eq=False)
class Frames:
    """Pictures of one camera that stands still.

    Args:
        rgb: ``(T, H, W, 3)``, 0 to 255.
        depth: along the optical axis ``(T, H, W)`` [m], NaN where there is none; or None.
        robot: pixels that show the robot ``(T, H, W)``, of which nothing is to be learned; or None.
        camera: that took them, or None where it is not known.
    """

    rgb: Image
    depth: DepthImage | None = None
    robot: BoolArray | None = None
    camera: Camera | None = None

    def __post_init__(self) -> None:
        rgb = self.rgb
        if rgb.ndim != 4 or rgb.shape[3] != 3 or rgb.dtype != np.uint8 or not rgb.size:
            raise InputError(f"frames must be uint8 of shape (T, H, W, 3), but are {rgb.dtype} of {rgb.shape}")
        for what, layer in (("depth", self.depth), ("the robot's mask", self.robot)):
            if layer is not None and layer.shape != rgb.shape[:3]:
                raise InputError(f"{what} has shape {layer.shape}, but the frames have {rgb.shape[:3]}")
        if self.camera is not None and (self.camera.height, self.camera.width) != rgb.shape[1:3]:
            raise InputError(
                f"the camera takes pictures of {self.camera.width} x {self.camera.height} pixels, but the frames have "
                f"{rgb.shape[2]} x {rgb.shape[1]}; scale the frames, or calibrate the camera at their size"
            )

    @classmethod
    def of(cls, source: "Frames | npt.NDArray[np.uint8]") -> "Frames":
        """Frames as they are, or a bare array ``(T, H, W, 3)`` of them."""
        return source if isinstance(source, Frames) else cls(np.asarray(source))

    @classmethod
    def joined(cls, parts: "Sequence[Frames]") -> "Frames":
        """Frames of several takes one after the other; a layer, or the camera, where all have it.

        Raises:
            InputError: they differ in size.
        """
        sizes = sorted({p.rgb.shape[2:0:-1] for p in parts})
        if len(sizes) > 1:
            told = " and ".join(f"{w} x {h}" for w, h in sizes)
            raise InputError(f"frames of {told} pixels cannot be joined; import them with the same --size")
        depth = [p.depth for p in parts if p.depth is not None]
        robot = [p.robot for p in parts if p.robot is not None]
        tables = [None if p.camera is None else p.camera.as_table() for p in parts]
        return cls(
            np.concatenate([p.rgb for p in parts]),
            np.concatenate(depth) if len(depth) == len(parts) else None,
            np.concatenate(robot) if len(robot) == len(parts) else None,
            parts[0].camera if all(t == tables[0] for t in tables) else None,
        )

    def __len__(self) -> int:
        return len(self.rgb)

    def __getitem__(self, kept: slice | npt.NDArray[np.int64] | BoolArray) -> "Frames":
        """Some of the frames, in any order."""
        depth = None if self.depth is None else self.depth[kept]
        return replace(self, rgb=self.rgb[kept], depth=depth, robot=None if self.robot is None else self.robot[kept])


@dataclass(frozen=True, eq=False)
class Video:
    """One take in pictures: a :class:`~muslin.core.measurement.Recording` before its points are found.

    Args:
        name: unique within its store.
        time: of the frames ``(T,)`` [s], rising, on the clock of the gripper poses.
        frames: T of them.
        gripper: gripper poses, or None when nothing moved.
        motion: takes with the same motion are repeats of each other; default the name.
        load: extra mass hung where the scenario says [kg].
    """

    name: str
    time: FloatArray
    frames: Frames
    gripper: Motion | None = None
    motion: str = ""
    load: float = 0.0

    def __post_init__(self) -> None:
        check_name(self.name)
        if self.time.shape != (len(self.frames),):
            raise InputError(f"video {self.name!r}: time has shape {self.time.shape} for {len(self.frames)} frames")
        if len(self.time) < 2 or not np.isfinite(self.time).all() or not (np.diff(self.time) > 0).all():
            raise InputError(f"video {self.name!r} needs at least 2 frames at finite times that rise")
        if not 0 <= self.load < float("inf"):
            raise InputError(f"video {self.name!r}: load must be finite and not negative, but is {self.load:g} kg")
        if not self.motion:
            object.__setattr__(self, "motion", self.name)
