"""Calibration: a known camera, distorted or not, is found again from pictures of a board."""

from pathlib import Path

import numpy as np
import pytest
from boards import CAMERA, CHARUCO, CHESS, DISTORTIONS, poses, seen

from muslin.core.camera import Camera
from muslin.core.camera_calibration import calibrated, placed
from muslin.core.chessboard import Board, Corners
from muslin.core.errors import InputError
from muslin.core.lens import Lens


@pytest.mark.parametrize("board", [CHESS, CHARUCO], ids=["chess", "charuco"])
@pytest.mark.parametrize("distortion", DISTORTIONS)
def test_a_known_camera_is_found_again(board: Board, distortion: str) -> None:
    lens = Lens(CAMERA, DISTORTIONS[distortion])
    views = [v for p in poses() if (v := board.find(seen(board, lens, p))) is not None]
    assert len(views) >= 5
    made = calibrated(views, 320, 240)
    assert made.error < 0.25
    for key in ("fx", "fy", "cx", "cy"):
        assert abs(getattr(made.lens.camera, key) - getattr(CAMERA, key)) < 3.0, key
    # the coefficients may trade off; what they do to the picture may not
    grid = np.stack(np.meshgrid(np.linspace(40, 280, 5), np.linspace(30, 210, 4)), axis=-1)
    assert np.abs(made.lens.undistorted_points(grid) - lens.undistorted_points(grid)).max() < 2.5


@pytest.mark.parametrize("board", [CHESS, CHARUCO], ids=["chess", "charuco"])
def test_the_board_on_the_table_says_where_the_camera_stands(board: Board) -> None:
    lens, pose = Lens(CAMERA, DISTORTIONS["barrel"]), poses()[2]
    view = board.find(seen(board, lens, pose))
    assert view is not None
    made, error = placed(lens, [view])
    assert error < 0.3
    if not board.dictionary and np.linalg.norm(made.camera.pose[:2] - pose[:2]) > 0.01:
        # a chessboard looks the same turned by half: then the origin is its last corner
        turned = np.array([6 * 0.03, -4 * 0.03, 0.0]) - made.camera.pose[:3] * [1, 1, -1]
        np.testing.assert_allclose(turned, pose[:3], atol=3e-3)
    else:
        np.testing.assert_allclose(made.camera.pose[:3], pose[:3], atol=3e-3)
        assert abs(float(made.camera.pose[3:] @ pose[3:])) > 0.9999


def test_a_camera_file_keeps_the_distortion(tmp_path: Path) -> None:
    lens = Lens(CAMERA, DISTORTIONS["barrel"])
    lens.save(tmp_path / "c.toml")
    again = Lens.load(tmp_path / "c.toml")
    np.testing.assert_array_equal(again.distortion, lens.distortion)
    assert Camera.load(tmp_path / "c.toml").as_table() == CAMERA.as_table()
    CAMERA.save(tmp_path / "plain.toml")
    assert not Lens.load(tmp_path / "plain.toml").distortion.size
    (tmp_path / "bad.toml").write_text((tmp_path / "plain.toml").read_text() + "distortion = [0.1]\n")
    with pytest.raises(InputError, match=r"bad\.toml: distortion must have 4, 5, 8, 12 or 14"):
        Lens.load(tmp_path / "bad.toml")


def test_points_are_undistorted_and_gaps_stay() -> None:
    lens = Lens(CAMERA, DISTORTIONS["barrel"])
    points = np.array([[[163.0, 117.0], [20.0, 30.0], [np.nan, np.nan]]])
    got = lens.undistorted_points(points)
    np.testing.assert_allclose(got[0, 0], points[0, 0], atol=1e-6)
    assert np.linalg.norm(got[0, 1] - points[0, 1]) > 5 and np.isnan(got[0, 2]).all()


def flat(count: int) -> list[Corners]:
    """Views of a board that always faces the camera."""
    row, column = np.divmod(np.arange(35), 7)
    board = np.stack([0.03 * column, -0.03 * row, 0.0 * row], axis=1)
    made = []
    for k in range(count):
        pixels = np.stack([60 + 20.0 * column + 5 * k, 60 + 20.0 * row], axis=1)
        made.append(Corners(board, pixels))
    return made


def test_pictures_that_tell_too_little_are_refused() -> None:
    with pytest.raises(InputError, match=r"found in 2 picture\(s\), at least 3"):
        calibrated(flat(2), 320, 240)
    with pytest.raises(InputError, match="tilt the board"):
        calibrated(flat(6), 320, 240)
    lens = Lens(CAMERA, np.zeros(0))
    views = [v for p in poses(4) if (v := CHESS.find(seen(CHESS, lens, p))) is not None]
    assert len(views) > 1
    with pytest.raises(InputError, match="does not lie in one place"):
        placed(lens, views)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Board(2, 9, 0.02), "3 to 100"),
        (lambda: Board(9, 6, 0.0), "--square"),
        (lambda: Board(9, 6, 0.02, "DICT_4X4_50", 0.03), "--marker"),
        (lambda: Board(9, 6, 0.02, "DICT_X", 0.01).find(np.zeros((9, 9, 3), np.uint8)), "no dictionary 'DICT_X'"),
    ],
)
def test_boards_that_cannot_be(make: object, told: str) -> None:
    with pytest.raises(InputError, match=told):
        make()  # type: ignore[operator]
