"""Bad input, each as a process of its own: status 2, one line that says what is wrong, nothing left behind."""

import contextlib
import os
import resource
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from running import Done, Muslin

TIME = np.linspace(0.0, 1.0, 11)


def write_npz(path: Path, **changes: np.ndarray) -> Path:
    rng = np.random.default_rng(0)
    np.savez(path, **{"time": TIME, "points": rng.uniform(-0.2, 0.2, (11, 4, 3)), **changes})
    return path


def refused(done: Done, *words: str) -> None:
    assert done.returncode == 2, done
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("muslin: error: ")
    assert "Traceback" not in done.stdout + done.stderr
    for word in words:
        assert word in lines[0]


def names(folder: Path) -> set[str]:
    return {p.name for p in folder.iterdir()}


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return write_npz(tmp_path / "take.npz")


def test_a_missing_file(muslin: Muslin, tmp_path: Path) -> None:
    refused(muslin("import", "nix.npz", "-o", "out.zarr"), "there is no file nix.npz")
    refused(muslin("fit", "nix.toml"), "there is no study file nix.toml")
    refused(muslin("new", "s.toml", "--measurement", "nix.zarr", "--scenario", "fling"), "no store at nix.zarr")
    assert names(tmp_path) == set()


def test_a_study_whose_measurement_is_missing(muslin: Muslin, tmp_path: Path, study: Path) -> None:
    (tmp_path / "m.zarr").rename(tmp_path / "moved.zarr")
    told = "study.toml, [study] measurement: there is no store at m.zarr"
    refused(muslin("fit", "study.toml"), told, "muslin import")


def test_a_wrong_unit(muslin: Muslin, tmp_path: Path, take: Path) -> None:
    refused(muslin("import", "take.npz", "-o", "out.zarr", "--unit", "inch"), "units are m, cm, mm, px")
    rng = np.random.default_rng(0)
    write_npz(tmp_path / "mm.npz", points=rng.uniform(-200, 200, (11, 4, 3)))
    refused(muslin("import", "mm.npz", "-o", "out.zarr"), "--unit mm")
    assert names(tmp_path) == {"take.npz", "mm.npz"}


def test_a_wrong_unit_in_a_study(muslin: Muslin, tmp_path: Path, study: Path) -> None:
    study.write_text(study.read_text() + '[parameters.stretch_stiffness]\nlow = 1.0\nhigh = 9.0\nunit = "Pa"\n')
    refused(muslin("fit", "study.toml"), "unit is 'Pa'", "'N/m'")
    assert names(tmp_path) == {"m.zarr", "study.toml"}


def test_time_going_backwards(muslin: Muslin, tmp_path: Path) -> None:
    backwards = TIME.copy()
    backwards[7] = 0.05
    write_npz(tmp_path / "take.npz", time=backwards)
    refused(muslin("import", "take.npz", "-o", "out.zarr"), "time[7] = 0.05 s follows time[6] = 0.6 s")
    assert names(tmp_path) == {"take.npz"}


def test_points_that_are_all_nan(muslin: Muslin, tmp_path: Path, take: Path) -> None:
    write_npz(tmp_path / "blind.npz", points=np.full((11, 4, 3), np.nan))
    # a good file before it must not leave half a measurement
    refused(muslin("import", "take.npz", "blind.npz", "-o", "out.zarr"), "blind.npz", "every point is NaN")
    assert names(tmp_path) == {"take.npz", "blind.npz"}


def test_a_grasp_vertex_that_does_not_exist(muslin: Muslin, tmp_path: Path, study: Path) -> None:
    study.write_text(study.read_text().replace("[simulator]", "grasps = [[0, 99]]\n[simulator]"))
    refused(muslin("fit", "study.toml"), "gripper 0 takes vertex 99", "0 to 8")
    assert names(tmp_path) == {"m.zarr", "study.toml"}


def test_an_unknown_plugin(muslin: Muslin, tmp_path: Path, study: Path) -> None:
    new = ("new", "s.toml", "--measurement", "m.zarr", "--scenario", "fling")
    refused(muslin(*new, "--simulator", "mujcoo"), "Did you mean 'mujoco'")
    refused(muslin(*new, "--estimator", "bayesim-rkhs"), "Did you mean 'bayessim-rkhs'")
    refused(muslin("add", "air-darg", "study.toml"), "Did you mean 'air-drag'")
    refused(muslin("check", "wnid"), "Did you mean 'wind'")
    study.write_text(study.read_text().replace('"mujoco"', '"mujcoo"'))
    refused(muslin("fit", "study.toml"), "there is no simulator 'mujcoo'")
    assert names(tmp_path) == {"m.zarr", "study.toml"}


@pytest.fixture
def broken(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The folder of an installed distribution whose simulator cannot be imported."""
    folder = tmp_path_factory.mktemp("site")
    info = folder / "wreck-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: wreck\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[muslin.simulators]\nwreck = wreck_engine:Wreck\n")
    (folder / "wreck_engine.py").write_text("raise RuntimeError('the engine has no licence')\n")
    return str(folder)


def test_a_broken_plugin(muslin: Muslin, tmp_path: Path, study: Path, broken: str) -> None:
    study.write_text(study.read_text().replace('"mujoco"', '"wreck"'))
    refused(muslin("fit", "study.toml", PYTHONPATH=broken), "simulator 'wreck'", "wreck 1.0", "no licence")
    new = ("new", "s.toml", "--measurement", "m.zarr", "--scenario", "fling", "--simulator", "wreck")
    refused(muslin(*new, PYTHONPATH=broken), "no licence")
    refused(muslin("check", "wreck", PYTHONPATH=broken), "no licence")
    assert names(tmp_path) == {"m.zarr", "study.toml"}
    listed = muslin("plugins", PYTHONPATH=broken)
    assert listed.returncode == 0
    assert "RuntimeError: the engine has no licence" in listed.stdout
    assert "air-drag" in listed.stdout


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 200 kB; only root can mount one."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = os.geteuid() == 0 and (
        subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", str(folder)], capture_output=True
        ).returncode
        == 0
    )
    if not mounted:
        pytest.skip("mounting a small disk needs root; the file size limit is tested instead")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def big_npz(path: Path) -> None:
    noise = np.random.default_rng(0).uniform(-0.2, 0.2, (2000, 30, 3))  # does not compress
    np.savez(path, time=np.arange(2000) * 0.01, points=noise)


def test_a_full_disk(muslin: Muslin, tmp_path: Path, small_disk: Path, study: Path) -> None:
    big_npz(tmp_path / "big.npz")
    refused(muslin("import", "big.npz", "-o", "disk/out.zarr"), "disk is full", "disk/out.zarr")
    assert names(small_disk) == set()
    with contextlib.suppress(OSError):
        (small_disk / "filler").write_bytes(bytes(1_000_000))
    before = names(small_disk)
    new = ("new", "disk/s.toml", "--measurement", "m.zarr", "--scenario", "fling", "--vertices", "3,3")
    refused(muslin(*new), "disk is full")
    refused(muslin("add", "wind", "study.toml", "-o", "disk/s2.toml"), "disk is full")
    assert names(small_disk) == before


def test_a_file_size_limit(muslin: Muslin, tmp_path: Path) -> None:
    big_npz(tmp_path / "big.npz")

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    refused(muslin("import", "big.npz", "-o", "out.zarr", limit=limit), "cannot write out.zarr", "too large")
    assert names(tmp_path) == {"big.npz"}


def test_what_is_there_is_not_replaced_unasked(muslin: Muslin, tmp_path: Path, take: Path, study: Path) -> None:
    refused(muslin("import", "take.npz", "-o", "m.zarr"), "exists already", "--force")
    refused(muslin("new", "study.toml", "--measurement", "m.zarr", "--scenario", "fling"), "--force")
    refused(muslin("add", "wind", "study.toml", "-o", "study.toml"), "the study itself")
    refused(muslin("diagnose", "study.toml", "--json", "no/such/v.json"), "there is no folder")


def test_the_command_line_itself(muslin: Muslin) -> None:
    refused(muslin("frobnicate"), "No such command", "muslin --help")
    refused(muslin("fit"), "STUDY.toml", "muslin fit --help")
    refused(muslin("fit", "s.toml", "--workers", "zero"), "--workers")


def test_debug_shows_the_traceback(muslin: Muslin) -> None:
    done = muslin("fit", "nix.toml", "--debug")
    assert done.returncode == 2
    assert "Traceback" in done.stderr and done.stderr.splitlines()[-1].startswith("muslin: error: ")
    assert "Traceback" in muslin("fit", "nix.toml", MUSLIN_DEBUG="1").stderr
