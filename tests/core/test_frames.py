"""Videos: pictures of a take, whole on disk, wrong ones refused."""

from pathlib import Path

import numpy as np
import pytest

from muslin.core.camera import Camera
from muslin.core.errors import InputError, StoreError
from muslin.core.frames import Frames, Video
from muslin.core.motion import Motion
from muslin.core.video_frames import VideoFrames
from muslin.core.video_store import load_videos, save_videos

CAMERA = Camera(32, 24, 30.0, 30.0, 15.5, 11.5)


def frames(count: int = 4) -> Frames:
    rng = np.random.default_rng(0)
    rgb = rng.integers(0, 255, (count, 24, 32, 3), dtype=np.uint8)
    depth = rng.random((count, 24, 32), dtype=np.float32)
    depth[1, 2, 3] = np.nan
    return Frames(rgb, depth, depth > 0.5, CAMERA)


def test_a_video_comes_back_whole(tmp_path: Path) -> None:
    video = Video("a", np.arange(4) / 30.0, frames(), Motion.still(2), "wave", 0.1)
    bare = Video("b", np.arange(4) / 30.0, Frames(frames().rgb))
    save_videos([video, bare], tmp_path / "v.zarr")
    got, other = load_videos(tmp_path / "v.zarr")
    for layer in ("rgb", "depth", "robot"):
        np.testing.assert_array_equal(getattr(got.frames, layer), getattr(video.frames, layer))
    assert got.frames.camera is not None and got.frames.camera.as_table() == CAMERA.as_table()
    assert (got.name, got.motion, got.load, other.motion) == ("a", "wave", 0.1, "b")
    assert got.gripper is not None and got.gripper.grippers == 2
    assert other.frames.depth is None and other.frames.camera is None and other.gripper is None


def test_some_frames_keep_all_layers() -> None:
    some = frames()[np.array([2, 0])]
    np.testing.assert_array_equal(some.rgb, frames().rgb[[2, 0]])
    assert some.depth is not None and some.robot is not None and some.camera is CAMERA and len(some) == 2


@pytest.mark.parametrize(
    ("made", "told"),
    [
        (lambda: Frames(np.zeros((2, 4, 4), np.uint8)), r"shape \(T, H, W, 3\)"),
        (lambda: Frames(np.zeros((2, 4, 4, 3))), "uint8"),
        (lambda: Frames(np.zeros((2, 4, 4, 3), np.uint8), np.zeros((2, 4, 5), np.float32)), "depth has shape"),
        (lambda: Frames(np.zeros((2, 4, 4, 3), np.uint8), camera=CAMERA), "32 x 24"),
        (lambda: Video("a", np.arange(3.0), frames()), "3"),
        (lambda: Video("a", np.array([0.0, 1.0, 1.0, 2.0]), frames()), "rise"),
        (lambda: Video("a/b", np.arange(4.0), frames()), "slashes"),
    ],
)
def test_what_cannot_be_a_video_is_refused(made: object, told: str) -> None:
    with pytest.raises(InputError, match=told):
        made()  # type: ignore[operator]


def test_takes_need_names_of_their_own(tmp_path: Path) -> None:
    video = Video("a", np.arange(4) / 30.0, frames())
    with pytest.raises(InputError, match="names of their own"):
        save_videos([video, video], tmp_path / "v.zarr")
    assert not (tmp_path / "v.zarr").exists()


def test_another_store_is_no_video(tmp_path: Path) -> None:
    save_videos([Video("a", np.arange(4) / 30.0, frames())], tmp_path / "v.zarr")
    (tmp_path / "v.zarr" / "a" / "rgb" / "zarr.json").write_text("{}")
    with pytest.raises(InputError, match="damaged"):
        load_videos(tmp_path / "v.zarr")


def test_a_frame_that_is_gone_is_damage_and_not_black(tmp_path: Path) -> None:
    path, dark = tmp_path / "v.zarr", Frames(np.zeros((4, 24, 32, 3), np.uint8))
    save_videos([Video("a", np.arange(4) / 30.0, dark)], path)
    assert not VideoFrames(path).rgb("a", 2).any()
    (path / "a" / "rgb" / "c" / "2" / "0" / "0" / "0").unlink()
    for read in (lambda: VideoFrames(path).rgb("a", 2), lambda: VideoFrames(path).some("a", [0, 2])):
        with pytest.raises(StoreError, match=r"damaged \(rgb/c/2/0/0/0 is missing\); import it again"):
            read()
    assert not VideoFrames(path).rgb("a", 1).any()
    with pytest.raises(InputError, match="is missing"):
        load_videos(path)
