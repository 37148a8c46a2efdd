import errno
import shutil
from pathlib import Path

import numpy as np
import pytest

from muslin.core.errors import InputError, MissingFileError, StoreError
from muslin.core.store import new_store, open_store, put, read, storage_errors, subgroup


def test_a_store_appears_only_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    with new_store(path) as root:
        put(root, "x", np.arange(3.0), ["n"], "m")
        assert not path.exists()
    assert read(open_store(path), "x").tolist() == [0, 1, 2]
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr"]


def test_a_failure_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), new_store(tmp_path / "a.zarr") as root:
        put(root, "x", np.arange(3.0), ["n"], "m")
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []


def test_a_failure_keeps_what_was_to_be_replaced(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    with new_store(path) as root:
        put(root, "x", np.array([1.0]), ["n"])
    with pytest.raises(ZeroDivisionError), new_store(path, overwrite=True) as root:
        raise ZeroDivisionError
    assert read(open_store(path), "x").tolist() == [1.0]
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr"]


def test_nothing_is_replaced_unasked(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    with new_store(path):
        pass
    with pytest.raises(InputError, match="--force"), new_store(path):
        pass
    file = tmp_path / "notes.txt"
    file.write_text("mine")
    with pytest.raises(InputError, match="not a Zarr store"), new_store(file, overwrite=True):
        pass
    assert file.read_text() == "mine"


def test_what_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="no store at"):
        open_store(tmp_path / "nix.zarr")
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match="not a Zarr store that muslin wrote"):
        open_store(tmp_path / "folder")
    with new_store(tmp_path / "a.zarr"):
        pass
    root = open_store(tmp_path / "a.zarr")
    with pytest.raises(StoreError, match="no array 'x'"):
        read(root, "x")
    with pytest.raises(InputError, match="no group 'g'"):
        subgroup(root, "g")


def test_another_format_is_refused(tmp_path: Path) -> None:
    with new_store(tmp_path / "a.zarr") as root:
        root.attrs["muslin_format"] = 99
    with pytest.raises(InputError, match="format 99"):
        open_store(tmp_path / "a.zarr")


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EACCES, errno.EROFS])
def test_the_operating_system_is_translated(number: int) -> None:
    words = {errno.ENOSPC: "full", errno.EDQUOT: "quota", errno.EACCES: "permission", errno.EROFS: "read-only"}
    with pytest.raises(StoreError, match=words[number]), storage_errors(Path("out.zarr")):
        raise OSError(number, "no")


def zeros(path: Path) -> Path:
    """A store of an array that holds nothing but the value that zarr takes for what is missing."""
    with new_store(path) as root:
        put(root.create_group("fit"), "x", np.zeros((3, 2)), ["n", "m"])
    return path


def test_a_chunk_that_is_gone_is_damage_and_not_zeros(tmp_path: Path) -> None:
    path = zeros(tmp_path / "a.zarr")
    assert not read(open_store(path), "fit/x").any()
    chunk = path / "fit" / "x" / "c" / "0" / "0"
    chunk.unlink()
    with pytest.raises(StoreError) as caught:
        read(subgroup(open_store(path), "fit"), "x")
    told = f"{path}, fit/x, is damaged (x/c/0/0 is missing); move the store away and run the fit again"
    assert str(caught.value) == told


def test_a_store_that_does_not_say_that_all_chunks_were_written_may_lack_some(tmp_path: Path) -> None:
    path = zeros(tmp_path / "a.zarr")
    shutil.rmtree(path / "fit" / "x" / "c")
    array = open_store(path, "r+")["fit/x"]
    del array.attrs["all_chunks_written"]
    assert not read(open_store(path), "fit/x").any()
