"""``muslin render`` in this process."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from muslin.cli.images import millimetres, read_image, write_image
from muslin.cli.main import run
from muslin.core.camera import Camera
from muslin.core.errors import BrokenPluginError, InputError, MissingFileError
from muslin.core.renderer import View, find_renderer

cv2 = pytest.importorskip("cv2")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in; the test is left out where nothing can draw or simulate."""
    pytest.importorskip("mujoco")
    try:
        find_renderer()
    except BrokenPluginError as error:
        pytest.skip(str(error))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def status(*arguments: str) -> int:
    with pytest.raises(SystemExit) as caught:
        run(arguments)
    return int(caught.value.code or 0)


def read(path: Path) -> Any:
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def test_a_scenario_becomes_pictures_that_agree_with_each_other(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_image(folder / "t.png", np.full((8, 8, 3), (0, 200, 0), np.uint8))
    write_image(folder / "b.png", np.full((30, 20, 3), (1, 2, 3), np.uint8))
    assert status("render", "hang", "-o", "out", "--fps", "2", "--texture", "t.png", "--background", "b.png") == 0
    out = capsys.readouterr().out
    assert "wrote out: 5 frames of 320 x 320" in out and "frames a second" in out and out.count("\n") == 1
    names = [f"{k:05d}.png" for k in range(5)]
    for kind in ("rgb", "depth", "segmentation"):
        assert sorted(p.name for p in (folder / "out" / kind).iterdir()) == names
    seen = read(folder / "out/segmentation/00004.png") == 1
    assert 0.05 < seen.mean() < 0.9
    rgb, depth = read(folder / "out/rgb/00004.png")[..., ::-1], read(folder / "out/depth/00004.png")
    assert (rgb[~seen] == [1, 2, 3]).all() and (rgb[seen][:, 1] > 60).all() and (rgb[seen][:, 0] < 20).all()
    assert depth.dtype == np.uint16 and ((depth > 0) == seen).all()
    camera = Camera.load(folder / "out/camera.toml")
    corner, far = camera.project(np.array([0.0, 0.0, 1.0 - 0.15]))
    u, v = np.rint(corner).astype(int)
    assert abs(int(depth[v, u]) - 1000 * far) < 15, "the middle of a hanging sheet is where it hangs"
    assert np.allclose(np.loadtxt(folder / "out/times.csv", skiprows=1), [0, 0.5, 1.0, 1.5, 2.0])


def test_a_study_is_drawn_at_its_own_times_with_a_camera_file(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mujoco")
    Camera.look_at(np.array([0.0, -1.0, 0.9]), np.array([0.0, 0.0, 0.85]), width=48, height=32).save(
        study.parent / "c.json"
    )
    target = study.parent / "out"
    call = ("render", str(study), "-o", str(target), "--camera", str(study.parent / "c.json"), "--recording", "two")
    assert status(*call) == 0
    said = capsys.readouterr().out
    assert "5 frames of 48 x 32" in said and "middle of its prior" in said
    assert (read(target / "segmentation/00000.png") == 1).any()
    assert status(*call) == 2 and "--force" in capsys.readouterr().err
    assert status(*call, "--force") == 0
    assert status(*call[:-1], "three", "--force") == 2 and "it has one, two" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--camera", "none.toml"), "there is no camera file none.toml"),
        (("--camera", "bad.toml"), "camera file bad.toml: position"),
        (("--texture", "bad.toml"), "bad.toml cannot be read as an image"),
        (("--background", "none.png"), "there is no image none.png"),
        (("--renderer", "tiyn"), "Did you mean 'tiny'"),
        (("--simulator", "mujocco"), "Did you mean 'mujoco'"),
        (("--fps", "0"), "--fps must be"),
        (("--fps", "0.1"), "one frame of a motion of 2 s"),
        (("--recording", "one"), "goes with a study"),
        (("-o", "no/out"), "there is no folder"),
        (("-o", "bad.toml"), "exists already"),
        (("-o", "bad.toml", "--force"), "was not written by muslin render"),
    ],
)
def test_what_cannot_be_is_one_line_and_leaves_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str], options: tuple[str, ...], told: str
) -> None:
    (folder / "bad.toml").write_text("fx = 3.0\n")
    assert status("render", "hang", "-o", "out", *options) == 2
    error = [line for line in capsys.readouterr().err.splitlines() if "error" in line]
    assert len(error) == 1 and told in error[0]
    assert [p.name for p in folder.iterdir()] == ["bad.toml"]


def test_an_unknown_scenario_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert status("render", "flnig", "-o", "out") == 2 and "Did you mean 'fling'" in capsys.readouterr().err
    assert status("render", "none.toml", "-o", "out") == 2 and "there is no study file" in capsys.readouterr().err


def test_a_failure_while_drawing_leaves_no_half_written_folder(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    right, calls = View.render, []

    def fails(self: View, *arguments: Any) -> Any:
        calls.append(1)
        if len(calls) == 3:
            raise InputError("the paint ran out")
        return right(self, *arguments)

    monkeypatch.setattr(View, "render", fails)
    assert status("render", "hang", "-o", "out", "--fps", "2") == 2
    assert "the paint ran out" in capsys.readouterr().err and not list(folder.iterdir())


def test_images_are_read_as_they_were_written_and_shrunk_when_huge(tmp_path: Path) -> None:
    picture = np.random.default_rng(0).integers(0, 255, (7, 5, 3), np.uint8)
    write_image(tmp_path / "a.png", picture)
    assert (read_image(tmp_path / "a.png") == picture).all()
    assert read_image(tmp_path / "a.png", (10, 4)).shape == (4, 10, 3)
    write_image(tmp_path / "wide.png", np.zeros((10, 4100, 3), np.uint8))
    assert read_image(tmp_path / "wide.png").shape == (5, 2048, 3)
    (tmp_path / "empty.png").touch()
    with pytest.raises(InputError, match="empty"):
        read_image(tmp_path / "empty.png")
    with pytest.raises(MissingFileError):
        read_image(tmp_path)


def test_depth_in_a_file_is_millimetres_and_saturates() -> None:
    depth = np.array([[np.nan, 0.0123, 1.5, 400.0]], np.float32)
    assert millimetres(depth).tolist() == [[0, 12, 1500, 65535]]
