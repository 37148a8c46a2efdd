"""Which takes ``muslin new`` chooses where nobody says, how it says so, and what it says of those that end early."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from running import cloth_measurement

from muslin.cli import main
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.scenarios import preset
from muslin.core.series import PointSeries
from muslin.core.study import read_config

COUNT = 14


def status(*arguments: object) -> int:
    with pytest.raises(SystemExit) as caught:
        main.run([str(a) for a in arguments])
    return int(caught.value.code or 0)


@pytest.fixture
def takes(tmp_path: Path) -> Path:
    """Of a rope that sways, the first fastest."""
    pytest.importorskip("mujoco")
    rest = preset("cable").scenario(size=[0.6], vertices=[11]).start_vertices()
    time = np.linspace(0.0, 0.2, 21)
    out = []
    for k in range(COUNT):
        sway = np.zeros((21, 1, 3))
        sway[:, 0, 1] = 0.1 * (COUNT - k) * time
        ends = (rest + sway)[:, [0, -1]]
        out.append(Recording(str(k), PointSeries(time, rest[::2] + sway), Motion.from_positions(time, ends)))
    save_measurement(Measurement(tuple(out)), tmp_path / "m.zarr")
    return tmp_path / "m.zarr"


def test_of_many_takes_five_are_fitted_and_four_held_out(takes: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = takes.with_name("s.toml")
    assert status("new", path, "--measurement", takes, "--scenario", "cable") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "chosen of 14 takes, so that what is held out starts neither fastest nor slowest; the other 5" in said
    assert "untouched; --fit-on and --hold-out choose otherwise" in said and "nothing is held out" not in said
    study = read_config(path).study
    assert study.fit_on == ["13", "10", "6", "3", "0"] and study.hold_out == ["11", "8", "5", "2"]


@pytest.mark.parametrize(
    "option, fitted, held_out",
    [
        ("--fit-on", ["3"], []),
        ("--hold-out", [str(k) for k in range(COUNT) if k != 3], ["3"]),
    ],
)
def test_who_says_one_of_them_is_asked_no_more(
    takes: Path, capsys: pytest.CaptureFixture[str], option: str, fitted: list[str], held_out: list[str]
) -> None:
    path = takes.with_name("s.toml")
    assert status("new", path, "--measurement", takes, "--scenario", "cable", option, "3") == 0
    assert "chosen of" not in capsys.readouterr().out
    study = read_config(path).study
    assert study.fit_on == fitted and study.hold_out == held_out


@pytest.mark.parametrize("given", [("--hold-out", "3", "--hold-out", "5"), ("--hold-out", "3,5")])
def test_an_option_given_twice_says_as_much_as_names_with_commas(takes: Path, given: tuple[str, ...]) -> None:
    path = takes.with_name("s.toml")
    assert status("new", path, "--measurement", takes, "--scenario", "cable", "--fit-on", "1", *given) == 0
    study = read_config(path).study
    assert study.fit_on == ["1"] and study.hold_out == ["3", "5"]


@pytest.mark.parametrize("option", [(), ("--vertices", "3,3"), ("--vertices", "5,5"), ("--hold-out", "two")])
def test_takes_that_differ_in_how_many_points_they_have_are_told_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: tuple[str, ...]
) -> None:
    pytest.importorskip("mujoco")
    one, two = cloth_measurement().recordings
    two = replace(two, series=replace(two.series, points=two.series.points[:, :8]))
    save_measurement(Measurement((one, two, replace(one, name="three"))), tmp_path / "m.zarr")
    new = ("new", tmp_path / "s.toml", "--measurement", tmp_path / "m.zarr", "--scenario", "fling")
    assert status(*new, *option) == 2
    said = capsys.readouterr().err
    assert "one, three: 9" in said and "two: 8" in said and "[scenario" not in said
    assert "--fit-on one,three" in said and "--points I,J" in said and not (tmp_path / "s.toml").exists()
    assert status(*new, "--fit-on", "one,three") == 0
    assert status(*new, "--force", "--points", "0,2,4,6") == 0


def test_poses_that_end_before_the_points_are_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mujoco")
    time = np.linspace(0.0, 1.8, 37)
    rest = preset("fling").body(vertices=[3, 3]).vertices + np.array([0.0, 0.0, 1.0])
    poses = np.zeros((13, 1, 3))
    poses[:, 0] = [0.0, 0.0, 1.0] + time[:13, None] * np.array([0.0, 0.2, 0.0])
    np.savez(
        tmp_path / "a.npz", time=time, points=np.tile(rest, (37, 1, 1)), gripper_pose=poses, gripper_time=time[:13]
    )
    assert status("import", tmp_path / "a.npz", "-o", tmp_path / "m.zarr") == 0
    told = "the gripper poses end at 0.6 s, the points go on to 1.8 s"
    assert f"warning: {told}" in capsys.readouterr().out
    made = ("--measurement", tmp_path / "m.zarr", "--scenario", "fling", "--vertices", "3,3")
    assert status("new", tmp_path / "s.toml", *made) == 0
    assert f"warning: a: {told}" in " ".join(capsys.readouterr().out.split())
