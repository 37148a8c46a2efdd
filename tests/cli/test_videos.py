"""muslin import of videos, calibrate-camera, extract and train: what they print, write and refuse."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from boards import CAMERA, CHESS, DISTORTIONS, poses, seen
from filmed import HEIGHT, WIDTH, pictures, place, write_folder, write_poses, write_video
from recorded_sets import write_lerobot

from muslin.cli.main import run
from muslin.core.arrays import FloatArray
from muslin.core.camera import Camera
from muslin.core.errors import InputError
from muslin.core.extractor import KeypointExtractor
from muslin.core.frames import Frames
from muslin.core.lens import Lens
from muslin.core.measurement_store import load_measurement
from muslin.core.registry import REGISTRY
from muslin.core.series import PointSeries
from muslin.core.video_store import load_videos

TIME = np.arange(66) / 30.0


class Reddest(KeypointExtractor):
    """The middle of what is red, moved by what was learned."""

    name = "reddest"
    needs_images = True

    def __init__(self, weights: str | None = None, threshold: int = 60) -> None:
        self._threshold = int(threshold)
        self._shift = np.array(json.loads(Path(weights).read_text())) if weights else np.zeros(2)

    def fit(self, frames, keypoints=None, progress=None) -> None:  # type: ignore[no-untyped-def]
        if keypoints is not None:
            found = self.extract(frames, np.arange(len(keypoints), dtype=float)).points
            self._shift = np.mean(keypoints - found, axis=(0, 1))

    def save(self, path: Path) -> None:
        Path(path).write_text(json.dumps(self._shift.tolist()))

    def extract(self, source: Any, time: FloatArray) -> PointSeries:
        rgb = Frames.of(source).rgb.astype(int)
        points = np.full((len(rgb), 1, 2), np.nan)
        for k, frame in enumerate(rgb):
            v, u = np.nonzero(frame[..., 0] - frame[..., 1] > self._threshold)
            if len(u):
                points[k, 0] = u.mean() + self._shift[0], v.mean() + self._shift[1]
        return PointSeries(time, points, "px")


class Outcome:
    """Exit status and what was printed of one command, run in this process."""

    def __init__(self, status: int, out: str, err: str) -> None:
        self.status, self.out, self.err = status, out, err


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(REGISTRY._objects, ("extractor", "reddest"), Reddest)

    def called(*arguments: str) -> Outcome:
        with pytest.raises(SystemExit) as ended:
            run(arguments)
        printed = capsys.readouterr()
        return Outcome(int(ended.value.code or 0), printed.out, printed.err)

    return called


def refused(done: Outcome, told: str) -> None:
    assert done.status == 2, done.err
    *progress, error = done.err.splitlines()
    assert error.startswith("muslin: error: ") and told in error
    assert not any("error" in line for line in progress)


@pytest.fixture
def take(tmp_path: Path) -> Path:
    write_poses(tmp_path / "poses.csv", np.arange(-10, 240) / 100.0)
    Camera(WIDTH, HEIGHT, 80.0, 80.0, 31.5, 23.5).save(tmp_path / "camera.toml")
    return write_video(tmp_path / "take.mp4", pictures(TIME))


def test_from_a_video_to_a_measurement(call: Any, take: Path, tmp_path: Path) -> None:
    done = call(
        "import", "take.mp4", "--poses", "poses.csv", "--camera", "camera.toml", "-o", "take.zarr", "--load", "0.1"
    )
    assert done.status == 0, done.err
    assert "take: 66 frames of 64 x 48 from 0 to 2.167 s, 30" in done.out and "1 gripper(s), load 0.1 kg" in done.out
    assert "the first frame is 0.100 s after the first pose" in done.out and "muslin extract take.zarr" in done.out
    done = call("extract", "take.zarr", "--extractor", "reddest", "-o", "points.zarr")
    assert done.status == 0, done.err
    (recording,) = load_measurement(tmp_path / "points.zarr").recordings
    assert (recording.series.unit, recording.load, recording.motion) == ("px", 0.1, "take")
    assert recording.camera is not None and recording.camera.fx == 80.0
    assert recording.gripper is not None and len(recording.gripper.times) == 250
    np.testing.assert_allclose(recording.series.points[:, 0, 0], np.round(8 + 400 * place(TIME)) + 5.5, atol=0.7)


def test_a_point_that_hardly_a_frame_shows_is_told(call: Any, tmp_path: Path) -> None:
    frames = pictures(TIME[:40])
    grey = [np.full_like(frames[0], 90) for _ in frames]
    for count, told in ((3, True), (4, False)):
        write_video(tmp_path / f"{count}.mp4", frames[:count] + grey[count:], TIME[:40])
        assert call("import", f"{count}.mp4", "-o", f"{count}.zarr").status == 0
        done = call("extract", f"{count}.zarr", "--extractor", "reddest", "-o", f"{count}-points.zarr")
        assert done.status == 0 and ("seen in less than a tenth of the frames: point 0" in done.out) == told, done.out


def test_training_from_annotated_frames(call: Any, take: Path, tmp_path: Path) -> None:
    assert call("import", "take.mp4", "-o", "take.zarr").status == 0
    names = [{"id": k, "file_name": f"take/{k}", "width": WIDTH, "height": HEIGHT} for k in (0, 20)]
    at = [[8 + round(400 * place(TIME[k])) + 9.5, 26.5, 2] for k in (0, 20)]
    marks = [
        {"id": n["id"], "image_id": n["id"], "category_id": 1, "keypoints": p} for n, p in zip(names, at, strict=True)
    ]
    table = {"images": names, "annotations": marks, "categories": [{"id": 1, "name": "a", "keypoints": ["middle"]}]}
    (tmp_path / "coco.json").write_text(json.dumps(table))
    assert call("train", "reddest", "take.zarr", "-o", "r.json").status == 0
    assert json.loads((tmp_path / "r.json").read_text()) == [0, 0]
    refused(call("train", "reddest", "take.zarr", "-o", "r.json"), "r.json exists already")
    (tmp_path / "bad.json").write_text(json.dumps(table | {"images": [names[0] | {"file_name": "x/9"}, names[1]]}))
    refused(call("train", "reddest", "take.zarr", "--annotations", "bad.json", "-o", "s.json"), "x/9")
    done = call("train", "reddest", "take.zarr", "--annotations", "coco.json", "-o", "s.json")
    assert done.status == 0 and "trained on 2 annotated frames" in done.out, done.err
    assert call("extract", "take.zarr", "--extractor", "reddest", "--weights", "s.json", "-o", "p.zarr").status == 0
    points = load_measurement(tmp_path / "p.zarr").recordings[0].series.points
    np.testing.assert_allclose(points[0, 0], (17.0, 26.0), atol=0.5)  # COCO counts from the corner


def test_several_files_become_takes_of_one_store(call: Any, take: Path, tmp_path: Path) -> None:
    write_folder(tmp_path / "seen", pictures(TIME[:20]), TIME[:20])
    done = call(
        "import", "take.mp4", "seen", "--name", "a", "--name", "b", "--motion", "m", "--size", "32x24", "-o", "v.zarr"
    )
    assert done.status == 0, done.err
    assert [(v.name, v.motion, v.frames.rgb.shape) for v in load_videos(tmp_path / "v.zarr")] == [
        ("a", "m", (66, 24, 32, 3)),
        ("b", "m", (20, 24, 32, 3)),
    ]


def test_a_rendered_folder_is_imported_whole(call: Any, tmp_path: Path) -> None:
    folder = tmp_path / "made"
    frames = pictures(TIME[:6])
    write_folder(folder / "rgb", frames)
    write_folder(folder / "depth", [np.full((HEIGHT, WIDTH), 900 * (k % 2), np.uint16) for k in range(6)])
    Camera(WIDTH, HEIGHT, 80.0, 80.0, 31.5, 23.5).save(folder / "camera.toml")
    (folder / "times.csv").write_text("time [s]\n" + "".join(f"{t:.6f}\n" for t in TIME[:6]))
    done = call("import", "made", "-o", "v.zarr")
    assert done.status == 0 and "50.0% of the depth are holes" in done.out, done.err
    (video,) = load_videos(tmp_path / "v.zarr")
    assert video.frames.camera is not None and video.frames.depth is not None
    assert np.isnan(video.frames.depth[0]).all() and np.all(video.frames.depth[1] == np.float32(0.9))


def test_what_is_wrong_is_told_and_nothing_is_written(call: Any, take: Path, tmp_path: Path) -> None:
    Camera().save(tmp_path / "other.toml")
    np.savez(tmp_path / "p.npz", time=TIME, points=np.random.default_rng(0).random((66, 2, 3)))
    (tmp_path / "broken.mp4").write_bytes(take.read_bytes()[:500])
    there = {p.name for p in tmp_path.iterdir()}
    for arguments, told in (
        (("take.mp4", "broken.mp4"), "broken.mp4 cannot be opened as a video"),
        (("take.mp4", "p.npz"), "take.mp4 is a video and p.npz is not"),
        (("p.npz", "--fps", "30"), "--fps goes with videos"),
        (("p.npz", "--offset", "auto"), "--offset goes with videos"),
        (("take.mp4", "--camera", "other.toml"), "but the camera takes pictures of 320 x 320"),
        (("take.mp4", "--camera", "nix.toml"), "no camera file nix.toml"),
        (("take.mp4", "--size", "big"), "--size must be width and height"),
        (("take.mp4", "--poses", "poses.csv", "--offset", "soon"), "--offset must be seconds or auto"),
        (("take.mp4", "--no-correspondence"), "--correspondence goes with points"),
        (("take.mp4", "--load", "-1"), "load must be finite and not negative"),
        (("take.mp4", "--take", "2"), "--take goes with a LeRobot data set"),
    ):
        refused(call("import", *arguments, "-o", "out.zarr"), told)
    assert {p.name for p in tmp_path.iterdir()} == there


def test_stores_and_extractors_that_do_not_fit(call: Any, take: Path, tmp_path: Path) -> None:
    assert call("import", "take.mp4", "-o", "take.zarr").status == 0
    assert call("extract", "take.zarr", "--extractor", "reddest", "-o", "points.zarr").status == 0
    study = ("new", "s.toml", "--scenario", "fling", "--measurement")
    refused(call(*study, "take.zarr"), "take.zarr is a video; extract points first: muslin extract take.zarr")
    refused(call(*study, "take.mp4"), "first: muslin import take.mp4 -o take.zarr")
    extract = ("extract", "take.zarr", "-o", "out.zarr", "--extractor")
    refused(call("extract", "points.zarr", "-o", "out.zarr", "--extractor", "reddest"), "is not a video")
    refused(call(*extract, "markers"), "takes points, not pictures; those that take them: ")
    refused(call(*extract, "reddes"), "Did you mean 'reddest'?")
    refused(call(*extract, "reddest", "--option", "treshold=3"), "Did you mean 'threshold'?")
    refused(call(*extract, "reddest", "--option", "threshold=[]"), "cannot be made with threshold=[]")
    refused(call(*extract, "reddest", "--option", "threshold=255"), "'take': every point is NaN")
    refused(call(*extract, "reddest", "--weights", "nix"), "no file nix; muslin train reddest writes one")
    refused(call("train", "markers", "take.zarr", "-o", "w"), "takes points, not pictures")
    assert not (tmp_path / "out.zarr").exists() and not (tmp_path / "s.toml").exists()


def test_points_in_pixels_keep_their_camera(call: Any, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(5, 40, (12, 3, 2))
    np.savez(tmp_path / "p.npz", time=TIME[:12], points=points, unit="px")
    lens = Lens(Camera(WIDTH, HEIGHT, 80.0, 80.0, 31.5, 23.5), np.array([-0.2, 0.05, 0.0, 0.0]))
    lens.save(tmp_path / "camera.toml")
    assert call("import", "p.npz", "--camera", "camera.toml", "-o", "p.zarr").status == 0
    (recording,) = load_measurement(tmp_path / "p.zarr").recordings
    assert recording.camera is not None and recording.camera.as_table() == lens.camera.as_table()
    np.testing.assert_allclose(recording.series.points, lens.undistorted_points(points))


def test_episodes_of_a_lerobot_set(call: Any, tmp_path: Path) -> None:
    write_lerobot(tmp_path / "set", "v3.0")
    done = call("import", "set", "--take", "1", "-o", "v.zarr")
    assert done.status == 0, done.err
    assert "gripper pose: observation.state (ee.x, ee.y, ee.z)" in done.out


def test_calibrating_a_camera(call: Any, tmp_path: Path) -> None:
    lens = Lens(CAMERA, DISTORTIONS["barrel"])
    write_folder(tmp_path / "board", [seen(CHESS, lens, p) for p in poses(6)])
    command = ("calibrate-camera", "board", "--square", "0.03", "-o", "camera.toml", "--board")
    done = call(*command, "7x5", "--world", "board/f2.png")
    assert done.status == 0, done.err
    assert "reprojection error" in done.out and "the camera is at (" in done.out
    made = Lens.load(tmp_path / "camera.toml")
    assert abs(made.camera.fx - CAMERA.fx) < 0.02 * CAMERA.fx and len(made.distortion) == 5
    refused(call(*command, "7x5"), "camera.toml exists already")
    (tmp_path / "camera.toml").unlink()
    refused(call(*command, "9x6"), "no chessboard of 9x6 inner corners")
    refused(call(*command, "big"), "--board must be columns x rows")
    refused(call("calibrate-camera", "board/f2.png", *command[2:], "7x5"), "found in 1 picture(s), at least 3")
    cv2.imwrite(str(tmp_path / "board/f9.png"), np.zeros((9, 9, 3), np.uint8))
    refused(call(*command, "7x5"), "f9.png has 9 x 9 pixels")
    assert not (tmp_path / "camera.toml").exists()


def test_joined_frames_keep_what_all_have() -> None:
    frames = np.stack(pictures(TIME[:3]))
    camera = Camera(WIDTH, HEIGHT, 80.0, 80.0, 31.5, 23.5)
    full = Frames(frames, np.ones(frames.shape[:3], np.float32), camera=camera)
    both = Frames.joined([full, full])
    assert len(both) == 6 and both.depth is not None and both.camera is camera
    assert Frames.joined([full, Frames(frames)]).depth is None
    with pytest.raises(InputError, match="48 x 64 and 64 x 48 pixels cannot be joined"):
        Frames.joined([full, Frames(np.ascontiguousarray(frames.transpose(0, 2, 1, 3)))])
