"""LeRobot data sets: episodes, cameras and the entries that are the gripper's pose."""

import json
from pathlib import Path

import numpy as np
import pytest
from filmed import RATE, pictures
from recorded_sets import CAMERA, LENGTHS, episode, write_lerobot, write_lerobot_images

from muslin.core.errors import InputError, MissingFileError
from muslin.core.frames import Video
from muslin.core.importing.video import VideoOptions, import_video


def imported(path: Path, **options: object) -> list[Video]:
    return [video for video, _ in import_video(path, VideoOptions(**options))]  # type: ignore[arg-type]


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_every_episode_has_its_own_frames_and_poses(version: str, tmp_path: Path) -> None:
    videos = imported(write_lerobot(tmp_path / "set", version), takes=("all",))
    assert [v.name for v in videos] == ["episode_000000", "episode_000001"]
    for number, video in enumerate(videos):
        time, state = episode(number)
        np.testing.assert_allclose(video.time, np.arange(LENGTHS[number]) / RATE, atol=1e-6)
        assert video.gripper is not None
        np.testing.assert_allclose(video.gripper.poses[:, 0, :3], state[:, 1:], atol=1e-6)
        assert np.abs(video.frames.rgb.astype(int) - np.stack(pictures(time))).mean() < 6


def test_pictures_may_lie_in_the_table(tmp_path: Path) -> None:
    (video,) = imported(write_lerobot_images(tmp_path / "set"), takes=("1",))
    np.testing.assert_array_equal(video.frames.rgb, pictures(episode(1)[0]))


def test_columns_are_named_or_numbered(tmp_path: Path) -> None:
    path = write_lerobot(tmp_path / "set", "v3.0")
    (video,) = imported(path, takes=("0",), pose_columns=("ee.z,1,joint_1", "3,3,3"))
    assert video.gripper is not None and video.gripper.grippers == 2
    state = episode(0)[1]
    np.testing.assert_allclose(video.gripper.poses[:, 0, :3], state[:, [3, 1, 0]], atol=1e-6)
    (bare,) = imported(path, takes=("episode_000000",), pose=("none",))
    assert bare.gripper is None


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({}, "2 episodes, 0 to 1; choose with --take"),
        ({"takes": ("7",)}, "no episode '7'; it has 2 episodes, 0 to 1"),
        ({"takes": ("0",), "image": "wrist"}, f"no camera 'wrist'; choose with --image one of {CAMERA}"),
        ({"takes": ("0",), "pose": ("action", "observation.state")}, "--pose names one feature; give --pose-columns"),
        ({"takes": ("0",), "pose": ("state",)}, r"no feature 'state'.*observation.state \(joint_1, ee.x, ee.y, ee.z\)"),
        ({"takes": ("0",), "pose_columns": ("ee.x,ee.y,tool",)}, "no entry 'tool'.*joint_1, ee.x"),
        ({"takes": ("0",), "pose_columns": ("1,2",)}, "must be 3"),
        ({"takes": ("0", "1"), "name": "a"}, "leave --name out"),
    ],
)
def test_what_is_not_there_is_told_with_what_is(options: dict[str, object], told: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=told):
        imported(write_lerobot(tmp_path / "set", "v3.0"), **options)


def test_states_that_name_no_position_are_listed(tmp_path: Path) -> None:
    state = {"dtype": "float32", "shape": [4], "names": {"motors": ["m1", "m2", "m3", "m4"]}}
    path = write_lerobot(tmp_path / "set", "v2.1", **{"observation.state": state})
    with pytest.raises(InputError, match=r"--pose none for no poses; there is observation.state \(m1, m2, m3, m4\)"):
        imported(path, takes=("0",))


def test_a_set_that_is_not_whole(tmp_path: Path) -> None:
    path = write_lerobot(tmp_path / "set", "v3.0")
    video = next(path.rglob("*.mp4"))
    data = next((path / "data").rglob("*.parquet"))
    held = data.read_bytes()
    data.write_bytes(held[:200])
    with pytest.raises(InputError, match="cannot be read as Parquet"):
        imported(path, takes=("0",))
    data.write_bytes(held)
    video.unlink()
    with pytest.raises(MissingFileError, match=r"lacks videos/.*fetch the whole set"):
        imported(path, takes=("0",))
    info = json.loads((path / "meta/info.json").read_text())
    (path / "meta/info.json").write_text(json.dumps(info | {"codebase_version": "v1.6"}))
    with pytest.raises(InputError, match=r"version v1\.6, but versions 2 and 3"):
        imported(path)
    (path / "meta/info.json").write_text("{}")
    with pytest.raises(InputError, match="not that of a LeRobot data set"):
        imported(path)
