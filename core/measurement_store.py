"""Measurements on disk: one group a recording."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import zarr

from .camera import Camera
from .errors import InputError
from .measurement import Measurement, Recording
from .motion import Motion
from .series import PointSeries, PointUnit
from .store import damage, new_store, open_store, put, subgroup, values

_AXES = ("x", "y", "z")


def save_measurement(
    measurement: Measurement,
    path: Path,
    *,
    hidden: Mapping[str, Any] | None = None,
    found_by: Mapping[str, Any] | None = None,
    overwrite: bool = False,
) -> None:
    """Write a store.

    Args:
        measurement: to write.
        path: of the new store.
        hidden: what a generated measurement hides, for the reader of a report; see :func:`read_hidden`.
        found_by: the extractor that found the points in pictures, its name and options; see :func:`read_found_by`.
        overwrite: replace a store that is there.
    """
    with new_store(path, overwrite=overwrite) as root:
        root.attrs.update({"kind": "measurement", "recordings": measurement.names})
        if found_by is not None:
            root.attrs["found_by"] = dict(found_by)
        if hidden is not None:
            root.attrs["hidden"] = dict(hidden)
        for r in measurement.recordings:
            group = root.create_group(r.name)
            group.attrs.update({"motion": r.motion, "load_kg": r.load, "correspondence": r.series.correspondence})
            put(group, "time", r.series.time, ["time"], "s")
            put(group, "axis", list(range(r.series.points.shape[2])), ["axis"], "1", "x, y, z")
            put(group, "points", r.series.points, ["time", "point", "axis"], r.series.unit, "measured points")
            if r.camera is not None:
                group.attrs["camera"] = r.camera.as_table()
            if r.gripper is not None:
                put_gripper(group, r.gripper)


def put_gripper(group: zarr.Group, gripper: Motion) -> None:
    """Write the gripper poses of one recording."""
    put(group, "gripper_time", gripper.times, ["gripper_time"], "s")
    dims = ["gripper_time", "gripper", "pose"]
    put(group, "gripper_pose", gripper.poses, dims, "m", "position x y z [m], quaternion w x y z")


def read_gripper(group: zarr.Group) -> Motion | None:
    """The gripper poses of one recording, or None where nothing moved."""
    if "gripper_pose" not in group:
        return None
    return Motion(values(group, "gripper_time"), values(group, "gripper_pose"))


def load_measurement(path: Path) -> Measurement:
    """Read a store; the hidden label of a generated measurement is not read."""
    root = open_store(path)
    if root.attrs.get("kind") == "video":
        raise InputError(
            f"{path} is a video; extract points first: muslin extract {path} --extractor NAME -o POINTS.zarr"
        )
    if root.attrs.get("kind") != "measurement":
        raise InputError(f"{path} is not a measurement but {root.attrs.get('kind')!r}; make one with: muslin import")
    names = cast(list[str], root.attrs.get("recordings", []))
    return Measurement(tuple(_recording(root, name, path) for name in names))


def read_found_by(path: Path) -> dict[str, Any] | None:
    """``name`` and options of the extractor that found the points in pictures, or None where they were measured."""
    found_by = open_store(path).attrs.get("found_by")
    return dict(cast(Mapping[str, Any], found_by)) if found_by is not None else None


def read_hidden(path: Path) -> dict[str, Any] | None:
    """What a generated measurement hides, or None. Only the report asks, after everything else is done."""
    hidden = open_store(path).attrs.get("hidden")
    return dict(cast(Mapping[str, Any], hidden)) if hidden is not None else None


def _recording(root: zarr.Group, name: str, path: Path) -> Recording:
    try:
        group = subgroup(root, name)
        unit = cast(PointUnit, str(group["points"].attrs["units"]))
        series = PointSeries(values(group, "time"), values(group, "points"), unit, bool(group.attrs["correspondence"]))
        table = cast(dict[str, Any] | None, group.attrs.get("camera"))
        camera = None if table is None else Camera.from_table(table)
        load = float(cast(float, group.attrs["load_kg"]))
        return Recording(name, series, read_gripper(group), str(group.attrs["motion"]), load, camera)
    except InputError as error:
        raise InputError(f"{path}, recording {name!r}: {error}") from error
    except Exception as error:  # what zarr raises on a damaged store depends on what is damaged
        raise InputError(f"{path}, recording {name!r} is damaged ({damage(error)}); import it again") from error
