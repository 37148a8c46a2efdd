"""Posteriors as .npz files without pickle: opened with one set of errors, and one within another."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError, MissingFileError
from ...core.estimator import Posterior
from .files import load_posterior


def write_archive(path: Path, form: str, **arrays: Any) -> None:
    """Write ``arrays`` under exactly the name ``path``, with the format that :func:`open_archive` asks for."""
    # Through an open file: given a name, np.savez would append ".npz" to one that lacks it.
    with Path(path).open("wb") as file:
        np.savez(file, format=form, **arrays)


@contextmanager
def open_archive(path: Path, form: str) -> Iterator[Any]:
    """The arrays by name.

    Raises:
        MissingFileError: there is no such file.
        InputError: it is of another format, or what the block does with it fails.
    """
    if not Path(path).is_file():
        raise MissingFileError(f"no posterior at {path}")
    try:
        with np.load(Path(path), allow_pickle=False) as data:
            if str(data["format"]) != form:
                raise InputError(f"{path} holds {str(data['format'])!r}, not {form!r}")
            yield data
    except (KeyError, OSError, ValueError, TypeError, AttributeError, RuntimeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path} is not a saved posterior of format {form!r}: {error}") from error


def parts_as_arrays(parts: Sequence[Posterior]) -> dict[str, Any]:
    """The bytes of every part's file by name."""
    arrays = {}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "part.npz"
        for k, part in enumerate(parts):
            part.save(file)
            arrays[f"part_{k}"] = np.frombuffer(file.read_bytes(), dtype=np.uint8)
    return arrays


def parts_in(data: Any) -> list[Posterior]:
    """What :func:`parts_as_arrays` made arrays of."""
    parts: list[Posterior] = []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "part.npz"
        while (name := f"part_{len(parts)}") in data:
            file.write_bytes(data[name].tobytes())
            parts.append(load_posterior(file))
    return parts
