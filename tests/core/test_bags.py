"""MCAP files and ROS bags: topics, clocks, encodings."""

from pathlib import Path

import numpy as np
import pytest
from filmed import HEIGHT, WIDTH, pictures, place
from recorded_sets import NOW, compressed, deep, image, pose, transforms, write_bag

from muslin.core.errors import InputError
from muslin.core.frames import Video
from muslin.core.importing.video import VideoOptions, import_video

TIME = np.arange(12) / 30.0 + 0.3
FRAMES = pictures(TIME)
DELAY = 0.05


def images(make=image, delay: float = DELAY, clock: float = NOW):  # type: ignore[no-untyped-def]
    return lambda: [(NOW + t + delay, make(p, clock + t)) for t, p in zip(TIME, FRAMES, strict=True)]


def poses(make=pose, delay: float = 0.002):  # type: ignore[no-untyped-def]
    fine = np.arange(20, 90) / 100.0
    return lambda: [(NOW + t + delay, make(NOW + t, x)) for t, x in zip(fine, place(fine), strict=True)]


def one(path: Path, **options: object) -> tuple[Video, str]:
    ((video, notes),) = import_video(path, VideoOptions(**options))  # type: ignore[arg-type]
    return video, "\n".join(notes)


@pytest.mark.parametrize(("name", "storage"), [("take.mcap", "mcap"), ("bag", "mcap"), ("bag", "sqlite3")])
def test_a_bag_gives_frames_and_poses_on_the_clock_of_their_headers(name: str, storage: str, tmp_path: Path) -> None:
    video, said = one(write_bag(tmp_path / name, {"/camera": images(), "/gripper": poses()}, storage))
    np.testing.assert_array_equal(video.frames.rgb, FRAMES)
    np.testing.assert_allclose(video.time, TIME - TIME[0], atol=1e-6)
    assert video.gripper is not None
    np.testing.assert_allclose(video.gripper.at(video.time)[:, 0, 0], place(TIME), atol=1e-3)
    np.testing.assert_allclose(video.gripper.poses[0, 0], (0.0, 0.1, 0.3, 0.8, 0.0, 0.0, 0.6), atol=1e-6)
    assert "0.050 s before they were written" in said and "in frame 'base'" in said


def test_the_time_of_writing_may_be_taken(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "take.mcap", {"/camera": images(), "/gripper": poses()})
    video, _ = one(path, clock="log")
    assert video.gripper is not None  # poses are written 48 ms sooner after their measurement than pictures
    assert abs(video.gripper.times[0] - (0.2 + 0.002 - 0.3 - DELAY)) < 1e-5


def test_two_clocks_are_noticed_and_no_stamps_are_replaced(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "own.mcap", {"/camera": images(clock=NOW - 7.0), "/gripper": poses()})
    with pytest.raises(InputError, match=r"different clocks: --offset 6\.9"):
        one(path)
    _, said = one(path, offset=7.0)
    assert "two clocks; --clock log" in said
    unstamped = images(make=lambda picture, time: image(picture, 0.0))
    video, said = one(write_bag(tmp_path / "none.mcap", {"/camera": unstamped, "/gripper": poses()}))
    np.testing.assert_allclose(video.time, TIME - TIME[0], atol=1e-6)
    assert "no time in their header" in said


def test_compressed_pictures_and_transforms(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "take.mcap", {"/camera/png": images(compressed), "/tf": poses(transforms)})
    with pytest.raises(InputError, match="poses of elbow, gripper; say --pose /tf:FRAME"):
        one(path)
    video, _ = one(path, pose=("/tf:gripper",))
    np.testing.assert_array_equal(video.frames.rgb, FRAMES)
    assert video.gripper is not None
    np.testing.assert_allclose(video.gripper.at(video.time)[:, 0, 0], place(TIME), atol=1e-3)
    assert one(path, pose=("none",))[0].gripper is None


@pytest.mark.parametrize("encoding", ["bgr8", "mono8", "rgba8"])
def test_encodings(encoding: str, tmp_path: Path) -> None:
    def made(picture: np.ndarray, time: float) -> object:
        full = np.full((*picture.shape[:2], 1), 255, np.uint8)
        data = {"bgr8": picture[..., ::-1], "mono8": picture[..., :1], "rgba8": np.concatenate([picture, full], axis=2)}
        return image(np.ascontiguousarray(data[encoding]), time, encoding)

    rgb = one(write_bag(tmp_path / "take.mcap", {"/camera": images(made)}))[0].frames.rgb
    wanted = np.stack(FRAMES)
    np.testing.assert_array_equal(rgb, np.repeat(wanted[..., :1], 3, axis=3) if encoding == "mono8" else wanted)


def test_what_is_not_there_is_told_with_what_is(tmp_path: Path) -> None:
    two = write_bag(tmp_path / "two.mcap", {"/left": images(), "/right": images(compressed), "/gripper": poses()})
    for options, told in (
        ({}, "2 image topics; choose with --image one of /left, /right"),
        ({"image": "/top"}, r"no image topic '/top'.*/gripper \(geometry_msgs/msg/PoseStamped\)"),
        ({"image": "/left", "pose": ("/arm",)}, "no pose topic '/arm'; choose with --pose one of /gripper"),
    ):
        with pytest.raises(InputError, match=told):
            one(two, **options)
    with pytest.raises(InputError, match="no topic with images; it has /gripper"):
        one(write_bag(tmp_path / "blind.mcap", {"/gripper": poses()}))
    far = images(lambda picture, time: image(picture, time, "16UC1"))
    with pytest.raises(InputError, match=r"encoding '16UC1'; pictures may have rgb8.*--depth-topic"):
        one(write_bag(tmp_path / "deep.mcap", {"/depth": far}))
    with pytest.raises(InputError, match="encoding 'rgb8'; depth may have 16UC1"):
        one(two, image="/left", depth_topic="/left", pose=("none",))
    with pytest.raises(InputError, match=r"format 'png'; compressed depth must be 16UC1"):
        one(two, image="/left", depth_topic="/right", pose=("none",))


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1", "png"])
def test_depth_has_a_topic_and_a_clock_of_its_own(encoding: str, tmp_path: Path) -> None:
    seen = 0.8 + 0.1 * TIME[:8]  # the last four frames have none

    def depths() -> list[tuple[float, object]]:
        made = []
        for t, metres in zip(TIME, seen, strict=False):
            layer = np.full((HEIGHT, WIDTH), metres)
            layer[3, 5] = 0.0
            made.append((NOW + t + 0.011 + DELAY, deep(layer, NOW + t + 0.011, encoding)))
        return made

    video, said = one(
        write_bag(tmp_path / "take.mcap", {"/camera": images(), "/depth": depths}),
        image="/camera",
        depth_topic="/depth",
    )
    assert video.frames.depth is not None
    np.testing.assert_allclose(video.frames.depth[:8, 0, 0], seen, atol=6e-4)
    assert np.isnan(video.frames.depth[:8, 3, 5]).all()
    # one and two frames after the last depth are 22 and 56 ms from it
    np.testing.assert_allclose(video.frames.depth[8, 0, 0], seen[-1], atol=6e-4)
    assert np.isnan(video.frames.depth[9:]).all() and "3 frames have no depth within 0.05 s" in said


def test_depth_of_another_size_is_refused(tmp_path: Path) -> None:
    small = lambda: [(NOW + t, deep(np.ones((4, 6)), NOW + t, "32FC1")) for t in TIME]  # noqa: E731
    path = write_bag(tmp_path / "take.mcap", {"/camera": images(), "/depth": small})
    with pytest.raises(InputError, match="depth topic has 6 x 4 pixels, but its frame has 64 x 48"):
        one(path, depth_topic="/depth")
    with pytest.raises(InputError, match="2 image topics; choose with --image one of /camera, /depth"):
        one(path)


def test_two_grippers_at_rates_of_their_own(tmp_path: Path) -> None:
    slow = np.arange(4, 20) / 20.0

    def other() -> list[tuple[float, object]]:
        return [(NOW + t + 0.002, pose(NOW + t, 1.0 - 2.0 * t)) for t in slow]

    bag = write_bag(tmp_path / "take.mcap", {"/camera": images(), "/left": poses(), "/right": other})
    with pytest.raises(InputError, match="2 pose topics; choose with --pose one of /left, /right"):
        one(bag)
    for order in (("/left", "/right"), ("/right", "/left")):
        video, said = one(bag, pose=order)
        assert video.gripper is not None and video.gripper.grippers == 2
        both = video.gripper.at(video.time)[:, :, 0]
        wanted = {"/left": place(TIME), "/right": 1.0 - 2.0 * TIME}
        np.testing.assert_allclose(both, np.stack([wanted[name] for name in order], axis=1), atol=1e-3)
        assert "poses of /left" in said and "poses of /right" in said


def test_two_transforms_of_one_topic(tmp_path: Path) -> None:
    video, _ = one(
        write_bag(tmp_path / "take.mcap", {"/camera": images(), "/tf": poses(transforms)}),
        pose=("/tf:gripper", "/tf:elbow"),
    )
    assert video.gripper is not None and video.gripper.grippers == 2


def test_grippers_that_share_no_time(tmp_path: Path) -> None:
    late = lambda: [(NOW + t, pose(NOW + t, 0.0)) for t in (5.0, 6.0)]  # noqa: E731
    path = write_bag(tmp_path / "take.mcap", {"/camera": images(), "/left": poses(), "/right": late})
    with pytest.raises(InputError, match=r"share no time.*4\.110 s after"):
        one(path, pose=("/left", "/right"))


def test_a_bag_that_is_cut_off(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "take.mcap", {"/camera": images()})
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(InputError, match="cannot be read as a bag"):
        one(path)
    (tmp_path / "junk.mcap").write_bytes(b"junk")
    with pytest.raises(InputError, match="cannot be read as a bag"):
        one(tmp_path / "junk.mcap")
