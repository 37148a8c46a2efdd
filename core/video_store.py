"""Videos on disk: one group a take, one chunk a frame, so that any stretch can be read alone."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy.typing as npt
import zarr

from .camera import Camera
from .errors import InputError
from .frames import Frames, Video
from .measurement_store import put_gripper, read_gripper
from .store import damage, new_store, open_store, put, put_frames, subgroup, values


def save_videos(videos: Sequence[Video], path: Path, *, overwrite: bool = False) -> None:
    """Write a store of kind ``"video"``.

    Args:
        videos: takes, each with a name of its own.
        path: of the new store.
        overwrite: replace a store that is there.
    """
    names = [v.name for v in videos]
    if not names or len(set(names)) < len(names):
        raise InputError(f"a store needs takes with names of their own, got {', '.join(names) or 'none'}")
    with new_store(path, overwrite=overwrite) as root:
        root.attrs.update({"kind": "video", "recordings": names})
        for v in videos:
            group = root.create_group(v.name)
            camera = None if v.frames.camera is None else v.frames.camera.as_table()
            group.attrs.update({"motion": v.motion, "load_kg": v.load, "camera": camera})
            put(group, "time", v.time, ["time"], "s")
            _put_pictures(group, "rgb", v.frames.rgb, "1", "red green blue, 0 to 255")
            if v.frames.depth is not None:
                _put_pictures(group, "depth", v.frames.depth, "m", "depth along the optical axis, NaN where none")
            if v.frames.robot is not None:
                _put_pictures(group, "robot", v.frames.robot, "1", "pixels that show the robot")
            if v.gripper is not None:
                put_gripper(group, v.gripper)


def load_videos(path: Path) -> tuple[Video, ...]:
    """Read every take of a store of kind ``"video"``."""
    root = open_store(path)
    if root.attrs.get("kind") != "video":
        raise InputError(f"{path} is not a video but {root.attrs.get('kind')!r}; make one with: muslin import")
    return tuple(_video(root, name, path) for name in cast(list[str], root.attrs.get("recordings", [])))


def _video(root: zarr.Group, name: str, path: Path) -> Video:
    try:
        group = subgroup(root, name)
        table = cast(dict[str, Any] | None, group.attrs.get("camera"))
        frames = Frames(
            values(group, "rgb"),
            values(group, "depth") if "depth" in group else None,
            values(group, "robot") if "robot" in group else None,
            None if table is None else Camera.from_table(table),
        )
        load = float(cast(float, group.attrs["load_kg"]))
        return Video(name, values(group, "time"), frames, read_gripper(group), str(group.attrs["motion"]), load)
    except InputError as error:
        raise InputError(f"{path}, video {name!r}: {error}") from error
    except Exception as error:  # what zarr raises on a damaged store depends on what is damaged
        raise InputError(f"{path}, video {name!r} is damaged ({damage(error)}); import it again") from error


def _put_pictures(group: zarr.Group, name: str, data: npt.NDArray[Any], unit: str, description: str) -> None:
    put_frames(group, name, data, ("time", "row", "column", "channel")[: data.ndim], unit, description)
