"""Datasets: recordings that others published, read by name."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from .arrays import FloatArray
from .errors import InputError, MissingFileError
from .measurement import Recording

#: So many names of takes are told where one is unknown.
_TOLD = 8


class Dataset(Protocol):
    """Reads one published set as it lies on disk.

    Recordings are in metres and seconds, z up, as measured: nothing smoothed, nothing filled in. What a reader had to
    leave out or put right it says with :func:`note`.
    """

    def __call__(self, path: Path, takes: Sequence[str]) -> list[Recording]:
        """The recordings of some takes.

        Args:
            path: of the file or folder.
            takes: names, in the order wanted; none: all.

        Raises:
            MissingFileError: there is no such file.
            InputError: it is not of this set, or has no such take.
        """


class DatasetNote(UserWarning):
    """What a reader left out or put right in a take."""


def note(text: str) -> None:
    """Say what a reader left out or put right; ``muslin import`` prints it."""
    warnings.warn(text, DatasetNote, stacklevel=2)


def chosen(takes: Sequence[str], known: Sequence[str], where: Path) -> list[str]:
    """The takes to read: those asked for, or all that are ``known``.

    Raises:
        InputError: one is not there, or asked for twice.
    """
    for name in takes:
        if name not in known:
            more = f", and {len(known) - _TOLD} more" if len(known) > _TOLD else ""
            raise InputError(f"{where} has no take {name!r}; it has {', '.join(known[:_TOLD])}{more}")
    twice = sorted({name for name in takes if list(takes).count(name) > 1})
    if twice:
        raise InputError(f"take {', '.join(twice)} is asked for twice; name each take once")
    return list(takes or known)


def cropped(recording: Recording, start: float | None, stop: float | None) -> Recording:
    """Only the frames with ``start <= time <= stop`` [s]; the clock is not shifted.

    Raises:
        InputError: fewer than two frames are left.
    """
    time = recording.series.time
    keep = (time >= (-np.inf if start is None else start)) & (time <= (np.inf if stop is None else stop))
    if keep.all():
        return recording
    if keep.sum() < 2:
        raise InputError(
            f"recording {recording.name!r}: fewer than 2 frames lie between start and stop; it goes from "
            f"{time[0]:g} to {time[-1]:g} s"
        )
    points = recording.series.points[keep]
    return replace(recording, series=replace(recording.series, time=time[keep], points=points))


def archives(path: Path, keys: Sequence[str]) -> dict[str, Path]:
    """NPZ files by name without suffix: ``path`` itself, or those in it that hold arrays of all names ``keys``.

    Raises:
        MissingFileError: there is no such file or folder.
        InputError: none of it is such a file; says what is missing.
    """
    if not path.exists():
        raise MissingFileError(f"there is no file or folder {path}")
    files = sorted(path.glob("*.npz")) if path.is_dir() else [path]
    if not files:
        raise InputError(f"{path} holds no .npz file; name the folder of the recordings, or one of them")
    for file in files:
        arrays(file, keys)
    return {file.stem: file for file in files}


def arrays(path: Path, keys: Sequence[str]) -> dict[str, FloatArray]:
    """Arrays of one NPZ file by name, numbers as float64, ``keys`` among them.

    Raises:
        InputError: not such a file, or an array is missing.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            missing = [key for key in keys if key not in archive.files]
            if missing:
                found = ", ".join(archive.files) or "nothing"
                raise InputError(f"{path} has no array {missing[0]!r}; it needs {', '.join(keys)}, and has {found}")
            made = {name: np.asarray(archive[name]) for name in archive.files}
    except InputError:
        raise
    except Exception as error:  # a damaged archive fails in many ways, none of them the caller's to know
        raise InputError(f"{path} is not an NPZ archive, or damaged ({type(error).__name__}); copy it again") from error
    return {name: a.astype(np.float64) if a.dtype.kind in "fiu" else a for name, a in made.items()}


def shaped(array: FloatArray, shape: Sequence[int | None], name: str, path: Path) -> FloatArray:
    """``array`` if it has this shape; None stands for any count.

    Raises:
        InputError: it has another.
    """
    if array.ndim != len(shape) or any(s not in (None, n) for s, n in zip(shape, array.shape, strict=True)):
        wanted = ", ".join("any" if s is None else str(s) for s in shape)
        raise InputError(f"{path}: {name} must have shape ({wanted}), but has {array.shape}")
    return array
