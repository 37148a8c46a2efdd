"""Datasets: recordings that others published, read by name."""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from numpy.lib.npyio import NpzFile

from .arrays import FloatArray
from .errors import InputError, MissingFileError
from .measurement import Recording
from .series import seconds

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
    """What a reader of a set or a file left out or put right in a take."""


def note(text: str) -> None:
    """Say what a reader left out or put right; ``muslin import`` prints it."""
    warnings.warn(text, DatasetNote, stacklevel=2)


def chosen(takes: Sequence[str], known: Sequence[str], where: Path) -> list[str]:
    """The takes to read: those asked for, or all that are ``known``.

    Raises:
        InputError: one is not there, or asked for twice.
    """
    if not known:
        raise InputError(f"{where} holds no takes")
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
            f"{seconds(time[0])} to {seconds(time[-1])} s"
        )
    points = recording.series.points[keep]
    return replace(recording, series=replace(recording.series, time=time[keep], points=points))


@contextmanager
def about(place: Path | str) -> Iterator[None]:
    """Say of what is wrong in this block in which file, or which part of a file, it is."""
    try:
        yield
    except InputError as error:
        if str(place) in str(error):
            raise
        raise InputError(f"{place}: {error}") from error


def archives(path: Path, keys: Sequence[str]) -> dict[str, Path]:
    """NPZ files by name without suffix: ``path`` itself, or those in it that hold arrays of all names ``keys``.

    Of each only the list of its arrays is read. Files of a folder that are of another kind are left out with a
    :func:`note`.

    Raises:
        MissingFileError: there is no such file or folder.
        InputError: one is damaged, or none of them is such a file; says what is missing.
    """
    if not path.exists():
        raise MissingFileError(f"there is no file or folder {path}")
    files = sorted(path.glob("*.npz")) if path.is_dir() else [path]
    if not files:
        raise InputError(f"{path} holds no .npz file; name the folder of the recordings, or one of them")
    lacking: dict[Path, str] = {}
    for file in files:
        with _opened(file) as archive:
            if complaint := _lacks(file, archive, keys):
                lacking[file] = complaint
    if len(lacking) == len(files):
        raise InputError(lacking[files[0]])
    if lacking:
        names = ", ".join(file.name for file in lacking)
        note(f"left out {names}: without one of the arrays {', '.join(keys)}, so not of this set")
    return {file.stem: file for file in files if file not in lacking}


def arrays(path: Path, keys: Sequence[str], optional: Sequence[str] = ()) -> dict[str, npt.NDArray[Any]]:
    """Arrays of one NPZ file by name: all ``keys``, and those of ``optional`` that are there. Others are not read.

    Raises:
        InputError: not such a file, or an array is missing or holds Python objects.
    """
    with _opened(path) as archive:
        if complaint := _lacks(path, archive, keys):
            raise InputError(complaint)
        return {name: _read(path, archive, name) for name in (*keys, *optional) if name in archive.files}


@contextmanager
def _opened(path: Path) -> Iterator[NpzFile]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            yield archive
    except InputError:
        raise
    except Exception as error:  # a damaged archive fails in many ways, none of them the caller's to know
        raise InputError(f"{path} is not an NPZ archive, or damaged ({type(error).__name__}); copy it again") from error


def _lacks(path: Path, archive: NpzFile, keys: Sequence[str]) -> str:
    missing = [key for key in keys if key not in archive.files]
    if not missing:
        return ""
    found = ", ".join(archive.files) or "nothing"
    return f"{path} has no array {missing[0]!r}; it needs {', '.join(keys)}, and has {found}"


def _read(path: Path, archive: NpzFile, name: str) -> npt.NDArray[Any]:
    try:
        return np.asarray(archive[name])
    except ValueError as error:
        if "allow_pickle" not in str(error):
            raise
        raise InputError(
            f"{path}: array {name!r} holds Python objects, which are not read because they may run code; save it as "
            "plain numbers or texts"
        ) from error


def shaped(array: npt.NDArray[Any], shape: Sequence[int | None], name: str, path: Path) -> FloatArray:
    """``array`` as float64 if it holds real numbers and has this shape; None stands for any count.

    Raises:
        InputError: it holds something else, or has another shape.
    """
    if array.dtype.kind not in "fiu":
        raise InputError(f"{path}: {name} must hold real numbers, but holds {array.dtype}")
    if array.ndim != len(shape) or any(s not in (None, n) for s, n in zip(shape, array.shape, strict=True)):
        wanted = ", ".join("any" if s is None else str(s) for s in shape)
        needed = f"have shape ({wanted})" if shape else "be one number"
        raise InputError(f"{path}: {name} must {needed}, but has shape {array.shape}")
    return array.astype(np.float64)
