"""The camera: where points fall in the picture, and the camera file."""

from pathlib import Path

import numpy as np
import pytest

from muslin.core.camera import Camera
from muslin.core.errors import InputError, MissingFileError


def test_a_camera_at_the_origin_sees_along_z_with_y_down() -> None:
    pixels, depth = Camera().project(np.array([[0.0, 0.0, 2.0], [0.1, 0.2, 2.0], [0.0, 0.0, -1.0]]))
    assert np.allclose(pixels[:2], [[159.5, 159.5], [159.5 + 20, 159.5 + 40]])
    assert np.isnan(pixels[2]).all() and np.allclose(depth, [2, 2, -1])


@pytest.mark.parametrize("eye", [(0.0, -2.0, 1.0), (1.0, 0.3, -0.4), (0.0, 0.0, 3.0), (0.0, 0.0, -3.0)])
def test_look_at_puts_the_target_in_the_middle_and_up_above(eye: tuple[float, float, float]) -> None:
    target = np.array([0.0, 0.0, 0.2])
    camera = Camera.look_at(np.array(eye), target, width=200, height=100)
    middle, depth = camera.project(target)
    assert np.allclose(middle, [99.5, 49.5]) and depth == pytest.approx(np.linalg.norm(target - eye))
    up = np.array([0.0, 0.0, 0.01]) if eye[:2] != (0.0, 0.0) else np.array([0.0, 0.01, 0.0])
    above, _ = camera.project(target + up)
    assert above[0] == pytest.approx(99.5) and above[1] < 49.5


def test_the_field_of_view_reaches_from_edge_to_edge() -> None:
    camera = Camera.look_at(np.zeros(3), np.array([0.0, 1.0, 0.0]), field_of_view=1.2, width=90, height=40)
    edge, _ = camera.project(np.array([np.tan(0.6), 1.0, 0.0]))
    assert edge[0] == pytest.approx(89.5)


def test_rays_go_through_what_is_projected() -> None:
    camera = Camera(40, 30, 50.0, 60.0, 12.0, 21.0, Camera.look_at(np.array([1.0, 2, 3]), np.zeros(3)).pose)
    pixels, depth = camera.project(camera.pose[:3] + 0.7 * camera.rays)
    u, v = np.meshgrid(np.arange(40), np.arange(30))
    assert np.allclose(pixels, np.stack([u, v], axis=-1)) and np.allclose(depth, 0.7)


@pytest.mark.parametrize("shape", [(320, 320), (200, 600), (600, 200)])
def test_framing_sees_everything_and_wastes_little(shape: tuple[int, int]) -> None:
    points = np.random.default_rng(0).normal(size=(7, 50, 3)) * [0.3, 0.1, 0.6] + [5.0, -2.0, 1.0]
    camera = Camera.framing(points, width=shape[0], height=shape[1], margin=1.1)
    pixels, depth = camera.project(points)
    share = (pixels + 0.5) / shape
    assert depth.min() > 0 and share.min() > 0 and share.max() < 1
    flat = share.reshape(-1, 2)
    low, high = flat.min(axis=0), flat.max(axis=0)
    assert np.allclose(low + high, 1.0) or np.isclose((low + high)[np.argmax(high - low)], 1.0), "not centred"
    assert (high - low).max() == pytest.approx(1 / 1.1)


def test_framing_one_point_keeps_a_distance() -> None:
    assert Camera.framing(np.ones((1, 3))).project(np.ones(3))[1] >= 0.05 - 1e-12


@pytest.mark.parametrize("name", ["c.toml", "c.json"])
def test_a_camera_file_gives_the_camera_back(tmp_path: Path, name: str) -> None:
    camera = Camera(64, 48, 50.5, 51.5, 30.0, 20.0, Camera.look_at(np.array([1.0, 2, 3]), np.zeros(3)).pose)
    camera.save(tmp_path / name)
    again = Camera.load(tmp_path / name)
    assert (again.width, again.height, again.fx, again.fy, again.cx, again.cy) == (64, 48, 50.5, 51.5, 30.0, 20.0)
    assert np.array_equal(again.pose, camera.pose)


def test_what_a_camera_file_leaves_out_is_the_middle_of_the_picture(tmp_path: Path) -> None:
    path = tmp_path / "c.toml"
    path.write_text("width = 100\nfx = 90.0\nposition = [0, 0, 0]\nquaternion = [1, 0, 0, 0]\n")
    camera = Camera.load(path)
    assert (camera.height, camera.fy, camera.cx, camera.cy) == (320, 90.0, 49.5, 159.5)


def test_a_quaternion_of_few_digits_still_only_turns(tmp_path: Path) -> None:
    path = tmp_path / "c.toml"
    path.write_text("fx = 90.0\nposition = [0, 0, 0]\nquaternion = [0.707, 0.707, 0, 0]\n")
    assert np.linalg.norm(Camera.load(path).local(np.array([3.0, 0.0, 4.0]))) == pytest.approx(5.0, rel=1e-12)


GOOD = {"width": "64", "fx": "50.0", "position": "[0, 0, 1]", "quaternion": "[1, 0, 0, 0]"}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"width": "0"}, "1 to 8192"),
        ({"width": "6.5"}, "width"),
        ({"fx": "-1.0"}, "focal lengths above zero"),
        ({"fx": "nan"}, "fx"),
        ({"fov": "1.0"}, "fov"),
        ({"position": "[0, 0]"}, "position"),
        ({"quaternion": "[2, 0, 0, 0]"}, "length 1"),
        ({"quaternion": ""}, "cannot be read"),
    ],
)
def test_a_bad_camera_file_is_refused_by_key(tmp_path: Path, change: dict[str, str], told: str) -> None:
    path = tmp_path / "c.toml"
    path.write_text("".join(f"{k} = {v}\n" for k, v in {**GOOD, **change}.items()))
    with pytest.raises(InputError, match=told) as caught:
        Camera.load(path)
    assert str(path) in str(caught.value)


def test_files_that_are_no_camera_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match=r"none\.toml"):
        Camera.load(tmp_path / "none.toml")
    for name, content in (("list.json", b"[1, 2]"), ("bytes.toml", b"\xff\xfe\x00"), ("half.json", b'{"fx": ')):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=name):
            Camera.load(tmp_path / name)


def test_looking_nowhere_is_refused() -> None:
    with pytest.raises(InputError, match="where it is"):
        Camera.look_at(np.ones(3), np.ones(3))
    with pytest.raises(InputError, match="field of view"):
        Camera.look_at(np.zeros(3), np.ones(3), field_of_view=3.2)
