"""The kit of datasets passes what is right and fails, with a sentence, what is broken in one way."""

import random
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from muslin.core.dataset import Dataset, archives, arrays, chosen, note, shaped
from muslin.core.errors import InputError
from muslin.core.measurement import Recording
from muslin.core.series import PointSeries
from muslin.core.testing import KITS, check_dataset, run_checks
from muslin.core.testing.checks import run_all
from muslin.core.testing.datasets import dataset_checks


def right(path: Path, takes: Sequence[str]) -> list[Recording]:
    files = archives(path, ("seen",))
    note("nothing was left out")
    made = []
    for name in chosen(takes, list(files), path):
        points = shaped(arrays(files[name], ("seen",))["seen"], (4, None, 3), "seen", files[name])
        made.append(Recording(name, PointSeries(np.arange(4.0), points)))
    return made


def only_some(path: Path, takes: Sequence[str]) -> list[Recording]:
    return [r for r in right(path, []) if not takes or r.name in takes]


def always_something(path: Path, takes: Sequence[str]) -> list[Recording]:
    return right(path, takes) if path.is_dir() and list(path.iterdir()) else []


def says_little(path: Path, takes: Sequence[str]) -> list[Recording]:
    try:
        return right(path, takes)
    except InputError:
        raise InputError("this cannot be read") from None


def fails(path: Path, takes: Sequence[str]) -> list[Recording]:
    if path.is_dir():
        next(path.glob("*.npz"))
    return right(path, takes)


def in_pixels(path: Path, takes: Sequence[str]) -> list[Recording]:
    return [replace(r, series=replace(r.series, unit="px")) for r in right(path, takes)]


def noisy(path: Path, takes: Sequence[str]) -> list[Recording]:
    made = right(path, takes)
    return [replace(r, series=replace(r.series, points=r.series.points + random.random())) for r in made]


def needs_more(path: Path, takes: Sequence[str], unit: str) -> list[Recording]:
    return right(path, takes)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "set"
    made.mkdir()
    for name in ("a", "b", "c"):
        np.savez(made / f"{name}.npz", seen=np.random.default_rng(ord(name)).normal(size=(4, 2, 3)))
    return made


def test_a_reader_that_keeps_its_promises_conforms(folder: Path) -> None:
    check_dataset(right, folder)
    check_dataset(right, folder / "a.npz")
    check_dataset(right)
    assert "dataset" in KITS and all(error is None for _, error in run_checks("dataset", right))


@pytest.mark.parametrize(
    ("read", "title", "said"),
    [
        (only_some, "gives the takes asked for, in their order", "asked for ['c', 'a'], it gives ['a', 'c']"),
        (only_some, "refuses takes that are not there, or asked for twice", "it does not refuse"),
        (always_something, "says that there is no such file", "does not refuse a path that leads nowhere"),
        (always_something, "refuses what is not of its set", "does not refuse an empty folder"),
        (says_little, "refuses what is not of its set", "does not name the path: this cannot be read"),
        (fails, "refuses what is not of its set", "StopIteration"),
        (in_pixels, "gives recordings in metres, of a name each", "in px, not in metres"),
        (noisy, "reads the same again", "global random generator"),
        (needs_more, "takes a path and names of takes", "missing a required argument: 'unit'"),
    ],
)
def test_the_kit_catches_a_faulty_reader(read: Dataset, title: str, said: str, folder: Path) -> None:
    complaint = dict(run_all(dataset_checks(read, folder)))[title]
    assert complaint is not None and said in complaint
