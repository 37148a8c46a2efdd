"""Zarr v3 stores that xarray opens: dimension names, units, and nothing half-written.

A single array write is atomic (zarr renames a finished file into place); a new store is built beside
its final place and renamed there at the end, so a reader sees all of it or none.
"""

import contextlib
import errno
import os
import shutil
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import zarr
from zarr.storage import LocalStore

from .errors import InputError, MissingFileError, MuslinError, StoreError

FORMAT = 1
#: Set on arrays of which every chunk was written, those that hold nothing but the fill value, too. Older ones may lack
#: such chunks.
_COMPLETE = "all_chunks_written"


class _Lacking(Exception):
    """What a store lacks, in words."""


@contextlib.contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Turn a full disk or a missing permission into one clear :class:`StoreError`."""
    try:
        yield
    except OSError as error:
        if isinstance(error, StoreError | MissingFileError):
            raise
        reason = {
            errno.ENOSPC: "the disk is full; free some space and run the same command again",
            errno.EDQUOT: "the disk quota is used up; free some space and run the same command again",
            errno.EACCES: "no permission to write there",
            errno.EROFS: "the file system is read-only",
        }.get(error.errno or 0, str(error))
        raise StoreError(f"cannot write {path}: {reason}") from error


@contextlib.contextmanager
def new_store(path: Path, *, overwrite: bool = False) -> Iterator[zarr.Group]:
    """A new store that appears at ``path`` when the block ends well, and leaves nothing behind otherwise."""
    if path.exists() and not overwrite:
        raise InputError(f"{path} exists already; choose another name, or say --force to replace it")
    if path.exists() and not (path / "zarr.json").exists():
        raise InputError(f"{path} exists and is not a Zarr store; it is not replaced")
    with new_folder(path) as partial:
        root = zarr.open_group(partial, mode="w", zarr_format=3)
        root.attrs["muslin_format"] = FORMAT
        yield root


@contextlib.contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """A folder that takes the place of ``path`` when the block ends well, and leaves nothing behind otherwise."""
    partial = path.absolute().with_name(f".{path.absolute().name}.{os.getpid()}.partial")
    with storage_errors(path):
        shutil.rmtree(partial, ignore_errors=True)
        try:
            partial.mkdir(parents=True)
            yield partial
            if path.exists():
                shutil.rmtree(path)
            partial.rename(path)
        finally:
            shutil.rmtree(partial, ignore_errors=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file beside its place and move it there: whole or absent, also on a full disk."""
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    with storage_errors(path):
        try:
            partial.write_text(text, encoding="utf-8")
            partial.replace(path)
        finally:
            with contextlib.suppress(OSError):
                partial.unlink(missing_ok=True)


def open_store(path: Path, mode: str = "r") -> zarr.Group:
    """Open an existing store; ``mode`` is ``"r"`` or ``"r+"``."""
    if not path.exists():
        raise MissingFileError(f"there is no store at {path}")
    try:
        root = zarr.open_group(path, mode="r+" if mode == "r+" else "r", zarr_format=3)
    except Exception as error:  # zarr fails in many ways on a folder that is none of its stores, or is damaged
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise InputError(f"{path} is not a Zarr store that muslin wrote: {reason}") from error
    found = root.attrs.get("muslin_format")
    if found != FORMAT:
        raise InputError(f"{path} has format {found!r}, but this muslin reads format {FORMAT}")
    return root


def damage(error: Exception) -> str:
    """What is wrong with a store, in one line, from what was raised as it was read."""
    return str(error) if isinstance(error, _Lacking) else f"{type(error).__name__}: {error}".splitlines()[0]


@contextlib.contextmanager
def damage_errors(path: Path, which: str = "") -> Iterator[None]:
    """Turn what zarr raises on a damaged store of results into one clear :class:`StoreError`.

    Args:
        path: of the store.
        which: part of it is read.
    """
    try:
        yield
    except MuslinError:
        raise
    except (_Lacking, OSError, ValueError, KeyError, RuntimeError, TypeError, AttributeError) as error:
        place = f", {which}," if which else ""
        raise StoreError(
            f"{path}{place} is damaged ({damage(error)}); move the store away and run the fit again"
        ) from error


def put(
    group: zarr.Group,
    name: str,
    data: npt.ArrayLike,
    dims: Sequence[str],
    unit: str = "1",
    description: str = "",
    **attributes: Any,
) -> zarr.Array[Any]:
    """Write one array whole, replacing one of that name."""
    values = np.asarray(data)
    array = group.create_array(
        name,
        data=np.ascontiguousarray(values),
        chunks=tuple(max(1, n) for n in values.shape),
        dimension_names=tuple(dims),
        overwrite=True,
        attributes={"units": unit, "long_name": description or name, _COMPLETE: 1, **attributes},
        config={"write_empty_chunks": True},
    )
    return array


def put_frames(
    group: zarr.Group, name: str, data: npt.NDArray[Any], dims: Sequence[str], unit: str, description: str
) -> None:
    """Write a new array with one chunk a frame (first axis)."""
    array = group.create_array(
        name,
        shape=data.shape,
        dtype=data.dtype,
        chunks=(1, *data.shape[1:]),
        dimension_names=tuple(dims),
        attributes={"units": unit, "long_name": description, _COMPLETE: 1},
        config={"write_empty_chunks": True},
    )
    array[...] = np.ascontiguousarray(data)


def empty_draws(
    group: zarr.Group, name: str, shape: tuple[int, ...], dims: Sequence[str], unit: str, dtype: str, fill: float
) -> zarr.Array[Any]:
    """An array with one chunk a draw (first axis), all missing."""
    return group.create_array(
        name,
        shape=shape,
        dtype=dtype,
        chunks=(1, *shape[1:]),
        fill_value=fill,
        dimension_names=tuple(dims),
        overwrite=True,
        attributes={"units": unit, "long_name": name},
    )


def subgroup(group: zarr.Group, name: str) -> zarr.Group:
    """The child group; :class:`InputError` if there is none."""
    child = group.get(name)
    if not isinstance(child, zarr.Group):
        raise InputError(f"store has no group {name!r}")
    return child


def read(group: zarr.Group, name: str) -> npt.NDArray[Any]:
    """One whole array of results; :class:`StoreError` if there is none of that name, or it cannot be read."""
    store = str(group.store_path.store).removeprefix("file://")
    with damage_errors(Path(store), f"{group.path}/{name}".removeprefix("/")):
        return values(group, name)


def values(group: zarr.Group, name: str) -> npt.NDArray[Any]:
    """One whole array; on a damaged store whatever zarr raises, which :func:`damage` puts in words."""
    array = group.get(name)
    if not isinstance(array, zarr.Array):
        raise _Lacking(f"it has no array {name!r}")
    _check_chunks(array, np.ndindex(*array.cdata_shape))
    return np.asarray(array[...])


def frame_of(array: zarr.Array[Any], number: int) -> npt.NDArray[Any]:
    """Entry ``number`` of the first axis of an array with one chunk a frame; raises as :func:`values`."""
    _check_chunks(array, [(range(array.shape[0])[number], *(0 for _ in array.shape[1:]))])
    return np.asarray(array[number])


def _check_chunks(array: zarr.Array[Any], chunks: Iterable[tuple[int, ...]]) -> None:
    """A chunk that is gone is damage, though zarr takes it for fill values. Looked up one by one: listing is slower."""
    if not (array.attrs.get(_COMPLETE) and isinstance(array.store_path.store, LocalStore)):
        return
    folder = str(array.store_path).removeprefix("file://")
    for chunk in chunks:
        key = array.metadata.encode_chunk_key(chunk)
        if not os.path.exists(f"{folder}/{key}"):
            raise _Lacking(f"{array.basename}/{key} is missing")
