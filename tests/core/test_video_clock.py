"""Two clocks: told apart from the motion in the picture, or not at all."""

from pathlib import Path

import numpy as np
import pytest
from filmed import RATE, pictures, place, write_folder, write_poses

from muslin.core.errors import InputError
from muslin.core.frames import Frames
from muslin.core.importing.video import VideoOptions, import_video
from muslin.core.importing.video.energy import estimated_offset
from muslin.core.motion import Motion

TIME = np.arange(66) / RATE
FINE = np.arange(-50, 300) / 100.0


def motion(times: np.ndarray, clock: float) -> Motion:
    positions = np.stack([place(times), np.zeros_like(times), np.zeros_like(times)], axis=1)
    return Motion.from_positions(times + clock, positions[:, None])


@pytest.mark.parametrize("clock", [0.0, 0.37, -0.8, 1.7e9])
def test_the_offset_is_found_to_a_third_of_a_frame(clock: float) -> None:
    found = estimated_offset(TIME, Frames(np.stack(pictures(TIME))), motion(FINE, clock))
    assert found.clear and found.correlation > 0.8
    assert abs(found.offset - clock) < 0.33 / RATE


def test_the_mask_of_the_robot_tells_more_than_a_busy_picture() -> None:
    rng = np.random.default_rng(1)
    frames = np.stack(pictures(TIME))
    robot = (frames[..., 0] > 150) & (frames[..., 1] < 120)
    busy = rng.integers(0, 255, frames.shape, dtype=np.uint8)  # everything moves, all the time
    assert not estimated_offset(TIME, Frames(busy), motion(FINE, 0.4)).clear
    found = estimated_offset(TIME, Frames(busy, robot=robot), motion(FINE, 0.4))
    assert found.clear and abs(found.offset - 0.4) < 0.5 / RATE


def test_motion_that_repeats_leaves_the_offset_open() -> None:
    swing = 0.05 * np.sin(2 * np.pi * 2.0 * FINE)
    poses = Motion.from_positions(FINE, np.stack([swing, 0 * swing, 0 * swing], axis=1)[:, None])
    frames = np.full((66, 48, 64, 3), 60, np.uint8)
    for k, x in enumerate(0.05 * np.sin(2 * np.pi * 2.0 * TIME)):
        frames[k, 16:30, round(28 + 400 * x) : round(28 + 400 * x) + 8] = 220
    found = estimated_offset(TIME, Frames(frames), poses)
    assert not found.clear and "fit alike" in found.reason


@pytest.fixture
def seen(tmp_path: Path) -> Path:
    return write_folder(tmp_path / "seen", pictures(TIME), TIME)


def imported(seen: Path, poses: Path, offset: float | None) -> tuple[np.ndarray, str]:
    ((video, notes),) = import_video(seen, VideoOptions(gripper=poses, offset=offset))
    return video.time, "\n".join(notes)


def test_a_wrong_offset_is_doubted_and_the_found_one_taken(seen: Path, tmp_path: Path) -> None:
    poses = write_poses(tmp_path / "poses.csv", FINE, 0.3)
    time, said = imported(seen, poses, 0.0)
    np.testing.assert_allclose(time, TIME, atol=1e-6)
    assert "the first frame is 0.200 s after the first pose" in said and "--offset auto takes that" in said
    time, said = imported(seen, poses, None)
    assert abs(time[0] - 0.3) < 0.012 and "found from the motion" in said
    time, said = imported(seen, poses, 0.3)
    np.testing.assert_allclose(time, TIME + 0.3, atol=1e-6)
    assert "offset +0.3 s, as given" in said and "the first frame is 0.500 s after the first pose" in said
    assert "--offset auto" not in said


def test_poses_on_the_clock_of_the_day_are_brought_to_the_first_frame(seen: Path, tmp_path: Path) -> None:
    poses = write_poses(tmp_path / "poses.csv", FINE, 1.7e9)
    with pytest.raises(InputError, match=r"different clocks: --offset 1699999999\.500 has both begin together"):
        imported(seen, poses, 0.0)
    ((video, notes),) = import_video(seen, VideoOptions(gripper=poses, offset=None))
    assert video.time[0] == 0.0 and video.gripper is not None
    assert abs(video.gripper.times[0] + 0.5) < 0.012
    assert any(n.startswith("time 0 is 17000000") or n.startswith("time 0 is 1699999999.99") for n in notes)


def test_without_motion_no_offset_is_made_up(tmp_path: Path) -> None:
    still = write_folder(tmp_path / "still", pictures(np.zeros(40)), TIME[:40])
    poses = write_poses(tmp_path / "poses.csv", FINE)
    with pytest.raises(InputError, match=r"does not tell the offset \(.*give --offset SECONDS"):
        imported(still, poses, None)
    assert "--offset auto" not in imported(still, poses, 0.0)[1]


def test_an_object_that_swings_on_does_not_tell_a_wrong_offset() -> None:
    moved = place(TIME)
    swing = np.zeros(len(TIME))  # a weight on a spring, pulled by the gripper, slow and hardly damped
    speed = 0.0
    for k in range(1, len(TIME)):
        speed += (60.0 * (moved[k] - swing[k - 1]) - 1.0 * speed) / RATE
        swing[k] = swing[k - 1] + speed / RATE
    frames = np.full((len(TIME), 48, 64, 3), 60, np.uint8)
    for k, x in enumerate(swing):
        left = max(0, round(12 + 250 * x))
        frames[k, 16:30, left : left + 12] = 220
    found = estimated_offset(TIME, Frames(frames), motion(FINE, 0.4))
    assert not found.clear or abs(found.offset - 0.4) < 2.0 / RATE, found
