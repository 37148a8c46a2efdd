"""``muslin import --dataset``."""

import subprocess
import sys
from pathlib import Path

import numpy as np

from muslin.core.measurement_store import load_measurement

DROPS = Path(__file__).resolve().parents[2] / "examples/balls/drops.csv"


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "muslin.cli", "import", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)


def test_takes_become_recordings_and_what_was_left_out_is_said(tmp_path: Path) -> None:
    takes = ["--take", "golf-ball-2,tennis-ball-1"]
    done = run(tmp_path, str(DROPS), "--dataset", "balls", *takes, "--stop", "2", "-o", "out.zarr")
    assert done.returncode == 0, done.stderr
    assert "golf-ball-2: left out 1 of 44 frames" in done.stdout and " m (z)" in done.stdout
    assert "--scenario NAME " in done.stdout and "scenarios: fling" in done.stdout  # none is guessed
    made = load_measurement(tmp_path / "out.zarr")
    assert made.names == ["golf-ball-2", "tennis-ball-1"]
    for recording in made.recordings:
        assert recording.series.time[-1] <= 2.0
        assert np.isfinite(recording.series.points[:, 0, 2]).all()


def test_takes_may_be_named_once_each(tmp_path: Path) -> None:
    takes = ["--take", "golf-ball-2", "--take", "tennis-ball-1"]
    assert run(tmp_path, str(DROPS), "--dataset", "balls", *takes, "-o", "out.zarr").returncode == 0
    assert load_measurement(tmp_path / "out.zarr").names == ["golf-ball-2", "tennis-ball-1"]


def test_all_takes_come_where_none_is_named(tmp_path: Path) -> None:
    assert run(tmp_path, str(DROPS), "--dataset", "balls", "-o", "out.zarr").returncode == 0
    assert len(load_measurement(tmp_path / "out.zarr").names) == 22


def test_mistakes_are_one_line_and_write_nothing(tmp_path: Path) -> None:
    for arguments, said in (
        (["--dataset", "bals"], "there is no dataset 'bals'. Did you mean 'balls'?"),
        (["--dataset", "balls", "--take", "golf"], "has no take 'golf'; it has baseball-1"),
        (["--dataset", "balls", "--up", "y"], "--up does not go with --dataset"),
        (["--dataset", "balls", "--take", "golf-ball-1,golf-ball-1"], "take golf-ball-1 is asked for twice"),
        (["--dataset", "balls", "--take", ","], "--take names no take"),
        (["--take", "golf-ball-1"], "say which set with --dataset"),
        (
            ["--dataset", "balls", "--take", "golf-ball-1", "golf-ball-2"],
            "drops.csv, golf-ball-2; import them one by one",
        ),
        (
            ["--dataset", "balls", "--start", "1", "--start", "2"],
            "2 times for 22 takes; give it once, or once a take",
        ),
    ):
        done = run(tmp_path, str(DROPS), *arguments, "-o", "out.zarr")
        assert done.returncode == 2 and said in done.stderr, done.stderr
        assert "Traceback" not in done.stderr and not (tmp_path / "out.zarr").exists()


def test_the_help_of_import_tells_of_sets(tmp_path: Path) -> None:
    told = " ".join(run(tmp_path, "--help").stdout.replace("│", " ").split())
    assert "with --dataset the one file or folder of that set" in told and "FILE" in told
