"""From a file to recordings: choose the reader, then put units, axes and names right."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..dataset import note
from ..errors import InputError, MissingFileError
from ..lens import Lens
from ..measurement import Recording
from ..motion import Motion
from ..series import PointSeries, seconds
from .axes import TURNS, turned
from .c3d import read_c3d
from .csv_points import read_csv
from .gripper import read_gripper_csv, to_motion
from .npz import read_npz
from .options import ImportOptions
from .quaternion_order import doubt_order
from .raw import RawTake
from .units import to_si, unit_named
from .zeros import unseen_zeros

#: Suffix -> reader.
FORMATS: dict[str, Callable[[Path], list[RawTake]]] = {".npz": read_npz, ".c3d": read_c3d, ".csv": read_csv}


def import_file(path: Path, options: ImportOptions | None = None) -> list[Recording]:
    """Recordings of one file, see :func:`import_together`; only a CSV can hold several."""
    return import_together([(path, options or ImportOptions())])


def import_together(files: Iterable[tuple[Path, ImportOptions]]) -> list[Recording]:
    """Recordings of one object. What is taken as not seen or put in another order is said with a warning.

    Points that have the same names in several files are put in the order of the first of these.

    Args:
        files: path and what a person says about it; the suffix says the format.

    Raises:
        MissingFileError: a file, or one of the gripper poses, does not exist.
        InputError: a file cannot be right; says where and what would be.
    """
    takes = [(take, path, options) for path, options in files for take in _read(path, options)]
    _doubt_names([(take, path) for take, path, _ in takes])
    orders: dict[frozenset[str], tuple[tuple[str, ...], Path]] = {}
    for take, path, _ in takes:
        orders.setdefault(frozenset(take.labels), (take.labels, path))
    return [
        _recording(_in_order(take, path, *orders[frozenset(take.labels)]), path, options)
        for take, path, options in takes
    ]


def _doubt_names(takes: list[tuple[RawTake, Path]]) -> None:
    """Say where points have other names than in the first file of as many: only their order says which is which."""
    first: dict[int, tuple[set[str], Path]] = {}
    for take, path in takes:
        names, other = first.setdefault(len(take.labels), (set(take.labels), path))
        if strange := sorted(set(take.labels) - names):
            missing = sorted(names - set(take.labels))
            note(
                f"{path}: its points {', '.join(strange)} are not in {other}, which has {', '.join(missing)}; they are "
                "taken for the same by the order in the file, so check that it is the same"
            )


def _in_order(take: RawTake, path: Path, order: tuple[str, ...], first: Path) -> RawTake:
    """The take with its points in the ``order`` of those in the file ``first``, which has the same names."""
    if take.labels == order or len(set(order)) < len(order) or len(take.labels) != len(order):
        return take  # of points that share a name nothing tells which is which
    note(f"{path}: its points, by their names, are put in the order of {first}")
    return replace(take, points=take.points[:, [take.labels.index(label) for label in order]], labels=order)


def _read(path: Path, options: ImportOptions) -> list[RawTake]:
    """The takes of a file as they are in it."""
    _check_file(path)
    if options.up not in TURNS:
        raise InputError(f"--up must be x, y or z, but is {options.up!r}")
    reader = FORMATS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(FORMATS)
        raise InputError(f"{path}: files ending in {path.suffix!r} cannot be imported; formats are {known}")
    if options.gripper is not None:
        _check_file(options.gripper)
    takes = reader(path)
    if len(takes) > 1 and options.name is not None:
        raise InputError(f"{path} holds {len(takes)} recordings with names of their own; leave --name out")
    return takes


def _check_file(path: Path) -> None:
    if not path.exists():
        raise MissingFileError(f"there is no file {path}")
    if not path.is_file():
        raise InputError(f"{path} is a folder; name a file")


def _recording(take: RawTake, path: Path, options: ImportOptions) -> Recording:
    name = options.name or take.name or path.stem
    where = f"{path}, recording {name!r}" if take.name else str(path)
    unit = unit_named(options.unit or take.unit or "m", str(path) if not options.unit else "--unit")
    gripper = _gripper(take, path, options, name, unit)
    told = [c for c in (options.correspondence, take.correspondence) if c is not None]
    correspondence = told[0] if told else True
    take = _without_zeros(take, correspondence, where)
    take = _cropped(take, options, where)
    points, si = to_si(take.points, unit, where)
    if take.gripper is not None and options.gripper is None and si == "m" and correspondence:
        doubt_order(take.time, points, to_motion(take.gripper, unit, "z", str(path)), where)
    points = turned(points, options.up, where)
    lens = None if options.camera is None else Lens.load(options.camera)
    if lens is not None and si == "px" and points.shape[2] == 2:
        points = lens.undistorted_points(points)
    if gripper is not None and (gripper.times[-1] < take.time[0] or gripper.times[0] > take.time[-1]):
        raise InputError(
            f"{where}: the gripper poses go from {seconds(gripper.times[0])} to {seconds(gripper.times[-1])} s, the "
            f"points from {seconds(take.time[0])} to {seconds(take.time[-1])} s; give both on the same clock"
        )
    try:
        series = PointSeries(take.time, points, si, correspondence)
        if not series.valid.any():  # a file that lacks a coordinate throughout has its columns mixed up
            raise InputError("every point is NaN in every frame; check the columns and the marker labels")
        load = options.load if options.load is not None else (take.load or 0.0)
        return Recording(
            name, series, gripper, options.motion or take.motion or "", load, lens.camera if lens else None
        )
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def _gripper(take: RawTake, path: Path, options: ImportOptions, name: str, unit: str) -> Motion | None:
    if options.gripper is not None:
        return to_motion(read_gripper_csv(options.gripper, name), unit, options.up, str(options.gripper))
    if take.gripper is not None:
        return to_motion(take.gripper, unit, options.up, str(path))
    return None


def _without_zeros(take: RawTake, correspondence: bool, where: str) -> RawTake:
    """The take without what stands for a point that was not seen."""
    lost = unseen_zeros(take.points, correspondence)
    if not lost.any():
        return take
    zeros = ", ".join("0" * take.points.shape[2])
    why = "which is far from where the same points are before or after" if correspondence else "more than one a frame"
    note(f"{where}: {lost.sum()} observations at exactly {zeros}, {why}, are taken as not seen (NaN)")
    return replace(take, points=np.where(lost[..., None], np.nan, take.points))


def _cropped(take: RawTake, options: ImportOptions, where: str) -> RawTake:
    """Only the frames from start to stop; the clock is not shifted, gripper poses share it."""
    low = -np.inf if options.start is None else options.start
    high = np.inf if options.stop is None else options.stop
    if low == -np.inf and high == np.inf:
        return take
    if not low < high:
        raise InputError(f"{where}: start must be before stop, but start = {low:g} s and stop = {high:g} s")
    keep = (take.time >= low) & (take.time <= high)
    if keep.sum() < 2:
        raise InputError(
            f"{where}: fewer than 2 frames lie between {low:g} and {high:g} s; "
            f"the file goes from {seconds(np.nanmin(take.time))} to {seconds(np.nanmax(take.time))} s"
        )
    return replace(take, time=take.time[keep], points=take.points[keep])
