"""The conformance kit of datasets."""

import inspect
import tempfile
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from ..dataset import Dataset, DatasetNote
from ..errors import MuslinError
from ..measurement import Measurement, Recording
from .checks import Check, check_leaves_random_state, must, must_raise, raise_failures

#: A take that no set has.
_NO_TAKE = "no such take"


def check_dataset(read: Dataset, path: Path | None = None) -> None:
    """Hold a reader against everything that muslin relies on.

    Args:
        read: the reader.
        path: recordings of its set, at best two takes or more; without them only what it does to other files is
            checked.

    Raises:
        AssertionError: lists every broken promise.
    """
    raise_failures("the dataset", dataset_checks(read, path))


def dataset_checks(read: Dataset, path: Path | None = None) -> list[Check]:
    """The checks of :func:`check_dataset`, one a promise; those of ``muslin check`` have no recordings."""
    foreign: dict[str, Callable[[Dataset], None]] = {
        "takes a path and names of takes": check_signature,
        "says that there is no such file": check_missing,
        "refuses what is not of its set": check_foreign,
    }
    own: dict[str, Callable[[Dataset, Path], None]] = {
        "gives recordings in metres, of a name each": check_recordings,
        "gives the takes asked for, in their order": check_order,
        "refuses takes that are not there, or asked for twice": check_unknown,
        "reads the same again": check_again,
    }
    checks = [Check(title, partial(check, read)) for title, check in foreign.items()]
    return checks + ([] if path is None else [Check(title, partial(check, read, path)) for title, check in own.items()])


def check_signature(read: Dataset) -> None:
    """It can be called."""
    must(callable(read), f"it is a {type(read).__name__}, which cannot be called")
    try:
        inspect.signature(read).bind(Path(), [])
    except TypeError as error:
        raise AssertionError(f"it cannot be called with a path and a list of takes: {error}") from error


def check_missing(read: Dataset) -> None:
    """A path that leads nowhere is a mistake of the caller's, told with the path."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("nowhere.npz", "nowhere.csv", "nowhere"):
            _refuses(read, Path(folder) / name, "a path that leads nowhere")


def check_foreign(read: Dataset) -> None:
    """So are an empty folder and files that hold something else."""
    with tempfile.TemporaryDirectory() as folder:
        empty = Path(folder) / "empty"
        empty.mkdir()
        _refuses(read, empty, "an empty folder")
        for suffix in (".npz", ".csv"):
            for k, content in enumerate((b"", b"nothing of the kind\n", bytes(range(256)))):
                file = Path(folder) / f"other{k}{suffix}"
                file.write_bytes(content)
                _refuses(read, file, f"a file that holds {content[:20]!r}")
        other = Path(folder) / "arrays.npz"
        np.savez(other, other=np.zeros(3))
        _refuses(read, other, "an archive of other arrays")


def check_recordings(read: Dataset, path: Path) -> None:
    """What comes out makes a measurement."""
    recordings = _takes(read, path)
    must(isinstance(recordings, list) and recordings, "it gives no list of recordings")
    for recording in recordings:
        must(isinstance(recording, Recording), f"it gives a {type(recording).__name__}, not a Recording")
    measurement = Measurement(tuple(recordings))
    must(measurement.unit == "m", f"its points are in {measurement.unit}, not in metres")


def check_order(read: Dataset, path: Path) -> None:
    """The last take and the first, asked for the other way round."""
    every = _takes(read, path)
    wanted = [r.name for r in (every[:1] if len(every) == 1 else [every[-1], every[0]])]
    got = _takes(read, path, *wanted)
    must([r.name for r in got] == wanted, f"asked for {wanted}, it gives {[r.name for r in got]}")
    for recording in got:
        _same(recording, next(r for r in every if r.name == recording.name))


def check_unknown(read: Dataset, path: Path) -> None:
    """A take that is misspelt must not be passed over."""
    first = _takes(read, path)[0].name
    must_raise(
        MuslinError, lambda: _takes(read, path, _NO_TAKE), f"asked for the take {_NO_TAKE!r}, it does not refuse"
    )
    must_raise(MuslinError, lambda: _takes(read, path, first, first), "asked for a take twice, it does not refuse")


def check_again(read: Dataset, path: Path) -> None:
    """Nothing is drawn."""
    got: list[list[Recording]] = []
    check_leaves_random_state(lambda: got.append(_takes(read, path)))
    for a, b in zip(got[0], _takes(read, path), strict=True):
        _same(a, b)


def _takes(read: Dataset, path: Path, *takes: str) -> list[Recording]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DatasetNote)
        return read(path, list(takes))


def _same(a: Recording, b: Recording) -> None:
    same = np.array_equal(a.series.time, b.series.time) and np.array_equal(a.series.points, b.series.points, True)
    if a.gripper is not None and b.gripper is not None:
        same = same and np.array_equal(a.gripper.poses, b.gripper.poses)
    must(same and a.motion == b.motion and (a.gripper is None) == (b.gripper is None), f"take {a.name!r} differs")


def _refuses(read: Dataset, path: Path, what: str) -> None:
    try:
        _takes(read, path)
    except MuslinError as error:
        must(str(path) in str(error), f"what it says of {what} does not name the path: {error}")
        must("\n" not in str(error), f"what it says of {what} is more than one line")
    else:
        raise AssertionError(f"it does not refuse {what}")
