"""Importing video files and folders of pictures: what comes out, and what is refused."""

from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from filmed import HEIGHT, RATE, WIDTH, pictures, write_folder, write_poses, write_video

from muslin.core.camera import Camera
from muslin.core.errors import InputError, MissingFileError
from muslin.core.frames import Video
from muslin.core.importing.video import VideoOptions, import_video
from muslin.core.lens import Lens

TIME = np.arange(12) / RATE
FRAMES = pictures(TIME)


def one(path: Path, **options: object) -> Video:
    ((video, _),) = import_video(path, VideoOptions(**options))  # type: ignore[arg-type]
    return video


def notes(path: Path, **options: object) -> str:
    return "\n".join(import_video(path, VideoOptions(**options))[0][1])  # type: ignore[arg-type]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_folder(tmp_path / "seen", FRAMES, TIME)


def test_a_video_file_gives_its_frames(tmp_path: Path) -> None:
    video = one(write_video(tmp_path / "take.mp4", FRAMES))
    assert (video.name, video.gripper, video.frames.camera) == ("take", None, None)
    np.testing.assert_allclose(video.time, TIME, atol=1e-3)
    assert np.abs(video.frames.rgb[5].astype(int) - FRAMES[5]).mean() < 6  # compression


def test_frames_have_the_time_at_which_they_are_shown(tmp_path: Path) -> None:
    uneven = np.cumsum([0.02, 0.05, 0.02, 0.02, 0.2, 0.02, 0.03, 0.02, 0.05, 0.02, 0.02, 0.04])
    path = write_video(tmp_path / "take.mp4", FRAMES, uneven)
    np.testing.assert_allclose(one(path).time, uneven - uneven[0], atol=1.5e-3)
    np.testing.assert_allclose(one(path, fps=50.0).time, np.arange(12) / 50.0)
    np.testing.assert_allclose(one(path, start=0.1, stop=0.4).time, (uneven - uneven[0])[4:8], atol=1.5e-3)


def test_a_video_is_turned_as_a_player_shows_it(tmp_path: Path) -> None:
    video = one(write_video(tmp_path / "phone.mp4", FRAMES, turn=90))
    assert video.frames.rgb.shape == (12, WIDTH, HEIGHT, 3)
    assert np.abs(video.frames.rgb[0].astype(int) - np.rot90(FRAMES[0])).mean() < 6


def test_a_folder_of_pictures_in_the_order_of_their_numbers(folder: Path, tmp_path: Path) -> None:
    video = one(folder)
    np.testing.assert_array_equal(video.frames.rgb, FRAMES)
    np.testing.assert_allclose(video.time, TIME, atol=1e-6)
    bare = write_folder(tmp_path / "bare", FRAMES, ending="jpg")
    np.testing.assert_allclose(one(bare, fps=10.0).time, np.arange(12) / 10.0)
    with pytest.raises(InputError, match=r"when its 12 pictures were taken; give --fps"):
        one(bare)


def test_times_since_1970_begin_with_the_first_frame(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "seen", FRAMES, TIME + 1.7e9)
    poses = write_poses(tmp_path / "poses.csv", TIME, 1.7e9)
    video = one(path, gripper=poses)
    np.testing.assert_allclose(video.time, TIME, atol=2e-6)
    assert video.gripper is not None
    np.testing.assert_allclose(video.gripper.times, TIME, atol=2e-6)


def test_depth_has_holes_and_the_robot_a_mask(folder: Path, tmp_path: Path) -> None:
    depth = [np.full((HEIGHT, WIDTH), 1000 + k, np.uint16) for k in range(12)]
    depth[3][10, 20] = 0
    robot = [np.zeros((HEIGHT, WIDTH), np.uint8) for _ in range(12)]
    robot[3][5:8, :4] = 255
    layers = {"depth": write_folder(tmp_path / "d", depth), "robot": write_folder(tmp_path / "m", robot)}
    video = one(folder, start=0.09, **layers)  # layers belong to the frames that are kept
    assert video.frames.depth is not None and video.frames.robot is not None and len(video.frames) == 9
    assert np.isnan(video.frames.depth[0, 10, 20]) and np.isnan(video.frames.depth).sum() == 1
    np.testing.assert_allclose(video.frames.depth[:, 0, 0], np.arange(1.003, 1.0115, 0.001), atol=1e-6)
    assert video.frames.robot[0].sum() == 12 and not video.frames.robot[1].any()
    assert "holes" in notes(folder, **layers)


def test_scaling_scales_the_camera(folder: Path, tmp_path: Path) -> None:
    camera = Camera(WIDTH, HEIGHT, 80.0, 82.0, 30.0, 25.0)
    camera.save(tmp_path / "camera.toml")
    video = one(folder, camera=tmp_path / "camera.toml", size=(32, 24))
    assert video.frames.rgb.shape == (12, 24, 32, 3) and video.frames.camera is not None
    point = np.array([[0.1, 0.05, 0.9]])  # a point keeps its place in the picture, counted from the edge
    big, small = camera.project(point)[0] + 0.5, video.frames.camera.project(point)[0] + 0.5
    np.testing.assert_allclose(small, big / 2)


def test_distorted_frames_are_undistorted(tmp_path: Path) -> None:
    camera = Camera(160, 120, 150.0, 150.0, 79.5, 59.5)
    lens = Lens(camera, np.array([-0.3, 0.08, 0.001, -0.001, 0.0]))
    lens.save(tmp_path / "camera.toml")
    grid = np.array([(x, y, 1.0) for x in (-0.4, 0.0, 0.3) for y in (-0.25, 0.1)])
    seen, _ = cv2.projectPoints(grid, np.zeros(3), np.zeros(3), lens.matrix, lens.distortion)
    v, u = np.mgrid[:120, :160]
    spots = sum(np.exp(-((u - x) ** 2 + (v - y) ** 2) / 8.0) for x, y in seen.reshape(-1, 2))
    frame = np.repeat((255 * np.clip(spots, 0, 1)).astype(np.uint8)[..., None], 3, axis=2)
    video = one(write_folder(tmp_path / "seen", [frame, frame], np.array([0.0, 0.1])), camera=tmp_path / "camera.toml")
    assert video.frames.camera is not None and video.frames.camera.as_table() == camera.as_table()
    picture = video.frames.rgb[0, ..., 0].astype(float)
    for x, y in camera.project(grid)[0]:
        near = np.where((u - x) ** 2 + (v - y) ** 2 < 25, picture, 0)
        place = np.array([(near * u).sum(), (near * v).sum()]) / near.sum()
        np.testing.assert_allclose(place, (x, y), atol=0.15)


def test_greyscale_is_taken_and_said(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "grey", [f[..., 0] for f in FRAMES], TIME)
    assert one(path).frames.rgb.shape == (12, HEIGHT, WIDTH, 3)
    assert "greyscale" in notes(path)


def test_frames_that_no_pose_covers_are_left_out_and_said(folder: Path, tmp_path: Path) -> None:
    poses = write_poses(tmp_path / "poses.csv", TIME[:8])
    video = one(folder, gripper=poses)
    assert len(video.frames) == len(video.time) == 9  # the last pose holds for one frame
    assert "left out 3 of 12 frames, from 0.300 to 0.367 s" in notes(folder, gripper=poses)


def cut(path: Path, share: float = 0.5) -> Path:
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    return path


def only_sound(path: Path) -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("aac", rate=44100)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), format="flt", layout="mono")
        frame.rate, frame.pts = 44100, 0
        for packet in [*stream.encode(frame), *stream.encode()]:
            container.mux(packet)
    return path


def scrambled(path: Path) -> Path:
    data = bytearray(path.read_bytes())
    rng = np.random.default_rng(0)
    for k in rng.integers(len(data) // 4, len(data) // 2, 200):
        data[k] ^= 0xFF
    path.write_bytes(data)
    return path


LONG = pictures(np.arange(60) / RATE, noise=20.0)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda d: cut(write_video(d / "a.mp4", LONG)), "cannot be opened as a video.*cut off"),
        (lambda d: cut(write_video(d / "a.mp4", LONG, movflags="faststart")), "a.mp4 is cut off: .* with --stop"),
        (lambda d: cut(write_video(d / "a.mkv", LONG)), "a.mkv is cut off"),
        (lambda d: scrambled(write_video(d / "a.mp4", LONG)), "damaged|cannot be decoded"),
        (lambda d: only_sound(d / "a.mp4"), "no pictures, only audio"),
        (lambda d: write_video(d / "a.mp4", LONG[:1]), r"1 frame\(s\), at least 2"),
    ],
)
def test_video_files_that_cannot_be_right(make: object, told: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=told):
        one(make(tmp_path))  # type: ignore[operator]


def test_a_cut_off_video_is_good_up_to_its_cut(tmp_path: Path) -> None:
    path = cut(write_video(tmp_path / "a.mp4", LONG, movflags="faststart"))
    assert len(one(path, stop=0.3).time) == 10


def write_bytes(path: Path, data: bytes) -> None:
    path.write_bytes(data)


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda d: cv2.imwrite(str(d / "f4.png"), np.zeros((9, 9, 3), np.uint8)), "frame 4 has 9 x 9.*share a size"),
        (lambda d: cv2.imwrite(str(d / "f0.png"), np.zeros((48, 64), np.uint16)), "f0.png has 16 bits.*--depth"),
        (lambda d: write_bytes(d / "f2.png", b"junk"), "f2.png cannot be read as a picture"),
        (lambda d: write_bytes(d / "f12.png", (d / "f1.png").read_bytes()), "12 times for 13 pictures"),
        (lambda d: write_bytes(d / "time.csv", b"\n".join(b"%d" % (40 * k) for k in range(12))), "in milliseconds"),
        (lambda d: write_bytes(d / "time.csv", b"0\n0.1\nx\n"), "line 3: 'x' is no time"),
        (
            lambda d: write_bytes(d / "time.csv", b"\n".join(b"%d" % (k % 7) for k in range(12))),
            "frame 7 at 0 s follows",
        ),
    ],
)
def test_folders_that_cannot_be_right(spoil: object, told: str, folder: Path) -> None:
    spoil(folder)  # type: ignore[operator]
    with pytest.raises(InputError, match=told):
        one(folder)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"camera": "camera.toml"}, "frames of 64 x 48 pixels, but the camera takes pictures of 320 x 320"),
        ({"depth": "colour"}, r"greyscale of 16 bits in millimetres, but it has 3 channel\(s\) of 8 bits"),
        ({"depth": "few"}, "12 frames, but there are 2 pictures of depth"),
        ({"robot": "small"}, "8 x 6 pixels, but its frame has 64 x 48"),
        ({"robot": "nix"}, "no folder"),
        ({"start": 2.0}, "0 frame.*go from 0 to 0.366667 s"),
        ({"start": 2.0, "stop": 1.0}, "start must be before stop"),
        ({"gripper": "late.csv"}, "poses go from 50.000 to .* --offset 50.000 has both begin together"),
        ({"offset": 1.0}, "there are none; give --poses"),
        ({"fps": 0.0}, "--fps"),
        ({"size": (0, 4)}, "--size"),
        ({"unit": "px"}, "m, cm or mm"),
        ({"image": "top"}, "--image goes with a LeRobot data set or a bag"),
    ],
)
def test_options_that_do_not_fit(options: dict[str, object], told: str, folder: Path, tmp_path: Path) -> None:
    Camera().save(tmp_path / "camera.toml")
    write_folder(tmp_path / "colour", FRAMES)
    write_folder(tmp_path / "few", [np.ones((HEIGHT, WIDTH), np.uint16)] * 2)
    write_folder(tmp_path / "small", [np.ones((6, 8), np.uint8)] * 12)
    write_poses(tmp_path / "late.csv", TIME, 50.0)
    here = {
        k: tmp_path / v if isinstance(v, str) and k in ("camera", "depth", "robot", "gripper") else v
        for k, v in options.items()
    }
    with pytest.raises((InputError, MissingFileError), match=told):
        one(folder, **here)


def test_an_empty_folder_and_none_at_all(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no pictures in"):
        one(tmp_path / "empty", fps=30.0)
    with pytest.raises(MissingFileError):
        one(tmp_path / "nix.mp4")
