"""Annotations: kept exactly in COCO files, those of other programs read or refused, joined with their video."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from muslin.core.annotated_frames import annotated_frames, places
from muslin.core.annotations import ABSENT, HIDDEN, SEEN, UNDECIDED, Annotations, blank
from muslin.core.errors import InputError, MissingFileError, StoreError
from muslin.core.frames import Frames, Video
from muslin.core.keypoints_coco import coco_table, read_coco, write_coco
from muslin.core.video_frames import VideoFrames
from muslin.core.video_store import save_videos

NAMES = ("left", "right")


def some() -> Annotations:
    points = np.array([[[3.25, 4.0], [5.0, 6.5]], [[1.0, 2.0], [0, 0]], [[0.0, 0], [0, 0]], [[7.0, 8.0], [0, 0]]])
    flags = np.array([[SEEN, HIDDEN], [SEEN, ABSENT], [UNDECIDED] * 2, [SEEN, UNDECIDED]], np.int8)
    frames = ("a/0", "a/2", "b/1", "b/3")
    return Annotations(NAMES, frames, points, flags, np.full((4, 2), (16, 12)), ((0, 1),))


def same(one: Annotations, other: Annotations) -> bool:
    arrays = ("points", "flags", "sizes")
    equal = all(np.array_equal(getattr(one, k), getattr(other, k), equal_nan=k == "points") for k in arrays)
    named = ("names", "frames", "skeleton", "video")
    return equal and all(getattr(one, k) == getattr(other, k) for k in named)


@st.composite
def annotations(draw: st.DrawFn) -> Annotations:
    names = tuple(draw(st.lists(st.text("abcä _1", min_size=1).filter(str.strip), min_size=1, max_size=4, unique=True)))
    count = draw(st.integers(1, 4))
    place = st.floats(-0.5, 4000.0, allow_nan=False)
    points = draw(hnp.arrays(float, (count, len(names), 2), elements=place))
    flags = draw(hnp.arrays(np.int8, (count, len(names)), elements=st.integers(UNDECIDED, SEEN)))
    sizes = draw(st.sampled_from([np.zeros((count, 2), np.int64), np.full((count, 2), 4001)]))
    video = draw(st.dictionaries(st.text("xyz", min_size=1), st.text("0123abc"), max_size=2))
    edges = draw(st.lists(st.tuples(*[st.integers(0, len(names) - 1)] * 2), max_size=3))
    frames = tuple(f"take/{k}" for k in range(count))
    return Annotations(names, frames, points, flags, sizes, tuple(edges), video)


@settings(max_examples=60)
@given(made=annotations())
def test_what_is_written_is_read(made: Annotations, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.getbasetemp() / "k.json"
    write_coco(made, path)
    text = path.read_text(encoding="utf-8")
    got = read_coco(path)
    assert same(got, made)
    write_coco(got, path)
    assert path.read_text(encoding="utf-8") == text


def test_the_file_counts_from_the_corner_and_is_what_coco_asks_for() -> None:
    table = coco_table(some())
    assert [i["file_name"] for i in table["images"]] == ["a/0", "a/2", "b/1", "b/3"]
    first, second, last = table["annotations"]  # none of the frame that nobody looked at
    assert first["keypoints"] == [3.75, 4.5, 2, 5.5, 7.0, 1] and first["num_keypoints"] == 2
    assert first["bbox"] == [3.75, 4.5, 1.75, 2.5] and first["area"] == pytest.approx(1.75 * 2.5)
    assert second["keypoints"] == [1.5, 2.5, 2, 0, 0, 0] and "undecided" not in second
    assert last["image_id"] == 4 and last["undecided"] == ["right"]
    assert table["categories"][0]["skeleton"] == [[1, 2]]


def foreign(**changes: Any) -> dict[str, Any]:
    """As other programs write it: no sizes, boxes, run-length masks, other categories, ids that start anywhere."""
    segmentation = {"counts": [1, 2, 3], "size": [12, 16]}
    one = {"id": 70, "image_id": 9, "category_id": 3, "keypoints": [1, 2, 2, 0, 0, 0], "segmentation": segmentation}
    box = {"id": 71, "image_id": 9, "category_id": 4, "bbox": [0, 0, 3, 3], "iscrowd": 1}
    kinds = [{"id": 3, "name": "cloth", "keypoints": list(NAMES)}, {"id": 4, "name": "gripper"}]
    images = [{"id": 9, "file_name": "a/000001.png", "license": 1}, {"id": 12, "file_name": "a/000003.png"}]
    return {"images": images, "categories": kinds, "annotations": [one, box], **changes}


def written(folder: Path, table: Any) -> Path:
    (folder / "k.json").write_text(table if isinstance(table, str) else json.dumps(table))
    return folder / "k.json"


def test_a_file_of_another_program(tmp_path: Path) -> None:
    got = read_coco(written(tmp_path, foreign()))
    assert got.names == NAMES and got.frames == ("a/000001.png", "a/000003.png") and not got.sizes.any()
    np.testing.assert_array_equal(got.points[0], [[0.5, 1.5], [np.nan, np.nan]])
    np.testing.assert_array_equal(got.flags, [[SEEN, ABSENT], [UNDECIDED, UNDECIDED]])


def changed(entry: int = 0, **values: Any) -> dict[str, Any]:
    table = foreign()
    table["annotations"][entry] |= values
    return table


def two_kinds() -> dict[str, Any]:
    table = foreign()
    table["categories"][1]["keypoints"] = ["tip"]
    return table


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ("{", "not JSON"),
        ([], "bare list"),
        ({"images": []}, "categories: Field required"),
        (foreign(images=[]), "no images"),
        (foreign(images=[{"id": 9, "file_name": "a/1"}, {"id": 9, "file_name": "a/2"}]), "same id"),
        (foreign(images=[{"id": 9, "file_name": "a/1"}, {"id": 8, "file_name": "a/1"}]), "'a/1' is annotated twice"),
        (foreign(categories=[{"id": 3, "name": "cloth"}]), "no category with keypoints"),
        (two_kinds(), "'cloth', 'gripper'; say which"),
        (changed(image_id=10), "image 10, which is not"),
        (changed(keypoints=[1, 2, 2]), "3 numbers for 2 keypoints"),
        (changed(keypoints=[1, 2, 3, 0, 0, 0]), "v must be 0"),
        (changed(keypoints=[1, 2, "x", 0, 0, 0]), "valid number"),
        (changed(keypoints=[1, float("nan"), 2, 0, 0, 0]), "finite number"),
        (changed(1, category_id=3, keypoints=[1, 2, 2, 0, 0, 0]), "several objects with keypoints"),
        (foreign(images=[{"id": 9, "file_name": "a/1", "width": 4, "height": 1}]), "outside of the picture of 4 x 1"),
    ],
)
def test_what_cannot_be_read_is_refused(tmp_path: Path, table: Any, told: str) -> None:
    with pytest.raises(InputError, match=told):
        read_coco(written(tmp_path, table))


def test_a_category_is_chosen_by_name(tmp_path: Path) -> None:
    path = written(tmp_path, two_kinds())
    assert read_coco(path, "cloth").names == NAMES and read_coco(path, "gripper").names == ("tip",)
    with pytest.raises(InputError, match="no category 'rope'"):
        read_coco(path, "rope")
    with pytest.raises(MissingFileError):
        read_coco(tmp_path / "nix.json")


@pytest.fixture
def video(tmp_path: Path) -> VideoFrames:
    """Two takes of four frames; the first pixel of a frame tells which it is."""
    takes = []
    for k, name in enumerate("ab"):
        rgb = np.zeros((4, 12, 16, 3), np.uint8)
        rgb[:, 0, 0, 0], rgb[:, 0, 0, 1] = k, range(4)
        takes.append(Video(name, np.arange(4.0), Frames(rgb, np.ones((4, 12, 16), np.float32))))
    save_videos(takes, tmp_path / "v.zarr")
    return VideoFrames(tmp_path / "v.zarr")


def test_an_extractor_learns_from_the_finished_frames(video: VideoFrames) -> None:
    frames, keypoints = annotated_frames(some(), video)
    assert frames.rgb[:, 0, 0, :2].tolist() == [[0, 0], [0, 2]] and frames.depth is not None
    np.testing.assert_array_equal(keypoints, [[[3.25, 4.0], [np.nan] * 2], [[1.0, 2.0], [np.nan] * 2]])
    with pytest.raises(InputError, match="none of the 4 frames"):
        annotated_frames(blank(NAMES, some().frames, some().sizes, {}), video)


def of(frames: tuple[str, ...], size: int = 0, **video: str) -> Annotations:
    return blank(NAMES, frames, np.full((len(frames), 2), size), video)


def test_frames_are_found_by_name(video: VideoFrames, tmp_path: Path) -> None:
    assert places(of(("a/1", "b/000003.png")), video) == [("a", 1), ("b", 3)]
    assert places(of(("a/1",), a=video.fingerprint("a")), video) == [("a", 1)]
    with pytest.raises(InputError, match="4 frames, from 0"):
        places(of(("a/4",)), video)
    with pytest.raises(InputError, match="no recording"):
        places(of(("a/1", "c/1")), video)
    with pytest.raises(InputError, match=r"5 x 5 pixels, but .* 16 x 12"):
        places(of(("a/1",), 5), video)
    with pytest.raises(InputError, match="other frames"):
        places(of(("a/1",), a=video.fingerprint("b")), video)
    with pytest.raises(InputError, match="tells no place"):
        places(of(("1.png", "2.png", "3.png", "4.png")), video)
    save_videos([Video("a", np.arange(3.0), Frames(np.zeros((3, 12, 16, 3), np.uint8)))], tmp_path / "one.zarr")
    assert [n for _, n in places(of(("f10.png", "f9.png", "f8.png")), VideoFrames(tmp_path / "one.zarr"))] == [2, 1, 0]


def test_a_damaged_video(video: VideoFrames) -> None:
    for chunk in (video.path / "a" / "rgb" / "c").rglob("*"):
        if chunk.is_file():
            chunk.write_bytes(b"no picture")
    with pytest.raises(StoreError, match="damaged"):
        VideoFrames(video.path).rgb("a", 1)
