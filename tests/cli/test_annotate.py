"""``muslin annotate`` as a process that is asked over HTTP: only who knows the token, nothing lost, ends cleanly."""

import contextlib
import json
import re
import signal
import threading
import time
from collections.abc import Iterator
from http.client import HTTPException
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from annotate_process import Page

from muslin.cli.main import run
from muslin.core.frames import Frames, Video
from muslin.core.keypoints_coco import read_coco
from muslin.core.video_store import save_videos

NAMES = ("--names", "left,right")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    rgb = np.random.default_rng(0).integers(0, 255, (2, 6, 12, 16, 3), np.uint8)
    save_videos([Video(n, np.arange(6.0), Frames(p)) for n, p in zip("ab", rgb, strict=True)], tmp_path / "v.zarr")
    return tmp_path


@pytest.fixture
def page(folder: Path) -> Iterator[Page]:
    made = Page(folder, *NAMES, "--every", "2")
    yield made
    if made.process.poll() is None:
        made.process.kill()
    made.process.communicate()


def test_only_who_knows_the_token_sees_the_frames_that_are_listed(page: Page, folder: Path) -> None:
    status, html = page.ask()
    assert status == 200 and b"annotate.js" in html
    for part in re.findall(rb'(?:src|href)="([\w.]+)"', html):
        assert page.ask(part.decode())[0] == 200
    frames = page.state()["frames"]
    assert [(f["recording"], f["number"]) for f in frames] == [(r, n) for r in "ab" for n in (0, 2, 4)]
    status, data = page.ask("frame/4.png")
    shown = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    rgb = np.random.default_rng(0).integers(0, 255, (2, 6, 12, 16, 3), np.uint8)
    np.testing.assert_array_equal(shown, rgb[1, 2])
    for path in ("frame/6.png", "frame/-1.png", "frame/x.png", "../k.json", "annotate.py", "frame/../state"):
        assert page.ask(path)[0] == 404, path
    for path in ("/", "/state", "/frame/0.png", "/" + "x" * 22 + "/state"):
        status, answer = page.ask(path)
        assert status == 404 and b"recording" not in answer, path
    assert page.ask("state", Host="example.org")[0] == 404  # a foreign name that resolves to this machine


def test_a_post_is_in_the_file_and_a_stale_one_changes_nothing(page: Page, folder: Path) -> None:
    assert not (folder / "k.json").exists()
    assert page.post(1, 0, (3.5, 4.0, 2), (None, None, 0)) == (200, {"version": 1})
    kept = read_coco(folder / "k.json")
    assert kept.names == ("left", "right") and kept.frames[1] == "a/2"
    np.testing.assert_array_equal(kept.points[1, 0], [3.5, 4.0])
    before = (folder / "k.json").read_bytes()
    status, answer = page.post(1, 0, (9.0, 9.0, 2), (9.0, 9.0, 2))
    assert status == 409 and "another tab" in answer["error"] and answer["frame"]["version"] == 1
    assert answer["frame"]["points"][0] == {"u": 3.5, "v": 4.0, "flag": 2}
    assert page.post(2, 0, (1.0, 1.0, 2), (2.0, 2.0, 1))[0] == 200  # another frame is not held up
    assert page.post(1, 1, (None, None, -1), (None, None, -1))[0] == 200
    assert (folder / "k.json").read_bytes() != before


def test_bad_posts_are_refused_and_nothing_is_lost(page: Page, folder: Path) -> None:
    good = (1.0, 1.0, 2)
    page.post(0, 0, good, good)
    before = (folder / "k.json").read_bytes()
    bad: list[tuple[Any, ...]] = [
        (9, 0, good, good),
        (-1, 0, good, good),
        ("0", 1, good, good),
        (0, 1, good),
        (0, 1, (1.0, 1.0, 3), good),
        (0, 1, (None, 1.0, 2), good),
        (0, 1, (99.0, 1.0, 2), good),
        (0, 1, (float("nan"), 1.0, 2), good),
        (0, 1, ("x", 1.0, 2), good),
    ]
    for post in bad:
        status, answer = page.post(*post)
        assert status == 400 and answer["error"], post
    kind = {"Content-Type": "application/json"}
    for body in ("", "{", "[]", "null", "{}", "\ud800".encode("utf-8", "surrogatepass").decode("latin-1"), "[" * 9000):
        assert page.ask("points", "POST", body, **kind)[0] == 400
    assert page.ask("points", "POST", "x" * 200_000, **kind)[0] == 400
    assert page.ask("points", "POST", "{}", **{"Content-Type": "text/plain"})[0] == 400
    assert page.ask("/wrong/points", "POST", "{}", **kind)[0] == 404
    assert (folder / "k.json").read_bytes() == before and page.post(0, 1, good, good)[0] == 200


def test_what_another_program_wrote_is_not_overwritten(page: Page, folder: Path) -> None:
    page.post(0, 0, (1.0, 1.0, 2), (1.0, 1.0, 2))
    (folder / "k.json").write_text("mine")
    status, answer = page.post(0, 1, (2.0, 1.0, 2), (1.0, 1.0, 2))
    assert status == 500 and "another program" in answer["error"] and (folder / "k.json").read_text() == "mine"


def test_a_killed_one_leaves_a_whole_file_and_is_gone_on_with(page: Page, folder: Path) -> None:
    threading.Timer(0.3, page.process.kill).start()
    saved = 0
    with contextlib.suppress(OSError, HTTPException):  # killed between requests, or within an answer
        while True:
            status, answer = page.post(0, saved, (saved % 10 + 0.5, 1.0, 2), (1.0, 1.0, 2))
            assert status == 200
            saved = answer["version"]
    assert saved > 0 and page.end()[0] == -signal.SIGKILL
    kept = read_coco(folder / "k.json").points[0, 0, 0]
    assert kept in ((saved - 1) % 10 + 0.5, saved % 10 + 0.5)  # the last that was answered, or the one under way
    again = Page(folder)
    assert "1 of 6 frames annotated" in again.told
    assert again.state()["frames"][0]["points"][0]["u"] == kept
    status, out, error = again.end(signal.SIGINT)
    assert (status, error) == (0, "") and "wrote k.json: 1 of 6 frames annotated" in out
    assert "next: muslin train heatmap v.zarr --annotations k.json -o k.safetensors" in out


def test_done_on_the_page_ends_it(page: Page, folder: Path) -> None:
    page.post(0, 0, (1.0, 1.0, 2), (None, None, -1))
    assert page.ask("done", "POST", "{}", **{"Content-Type": "application/json"})[0] == 200
    status, out, error = page.end()
    assert (status, error) == (0, "") and "0 of 6 frames annotated, 1 more begun" in out
    assert "next: muslin annotate v.zarr -o k.json" in out


def test_nothing_annotated_writes_nothing(page: Page, folder: Path) -> None:
    time.sleep(0.2)
    status, out, _ = page.end(signal.SIGINT)
    assert status == 0 and "nothing was annotated" in out and not (folder / "k.json").exists()


def test_keypoints_of_another_program_are_taken_in(folder: Path) -> None:
    images = [{"id": 5, "file_name": "b/000003.png"}]
    entry = {"id": 1, "image_id": 5, "category_id": 1, "keypoints": [4.5, 5.5, 2, 6.5, 7.5, 1]}
    kinds = [{"id": 1, "name": "cloth", "keypoints": ["right", "left"]}]
    (folder / "other.json").write_text(json.dumps({"images": images, "annotations": [entry], "categories": kinds}))
    page = Page(folder, *NAMES, "--import", "other.json", "--count", "2")
    assert "took 1 annotated frames" in page.told
    assert [(f["recording"], f["number"]) for f in page.state()["frames"]] == [("a", 3), ("b", 3)]
    assert page.end(signal.SIGINT)[0] == 0
    kept = read_coco(folder / "k.json")
    assert kept.points[1].tolist() == [[6.0, 7.0], [4.0, 5.0]] and kept.flags[1].tolist() == [1, 2]


def test_what_cannot_be_annotated_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)

    def refused(*options: str, video: str = "v.zarr") -> str:
        with pytest.raises(SystemExit) as ended:
            run(["annotate", video, "-o", "k.json", "--no-browser", *options])
        told = capsys.readouterr().err
        assert ended.value.code == 2 and len(told.splitlines()) == 1, told
        return told

    (folder / "clip.mp4").write_bytes(b"film")
    assert "muslin import clip.mp4 -o clip.zarr" in refused(*NAMES, video="clip.mp4")
    assert "--names corner_a" in refused()
    assert "two keypoints are named 'a'" in refused("--names", "a,a")
    assert "give one of them" in refused(*NAMES, "--every", "2", "--count", "3")
    assert not (folder / "k.json").exists()
    page = Page(folder, *NAMES)
    page.post(0, 0, (1.0, 1.0, 2), (1.0, 1.0, 2))
    page.end(signal.SIGINT)
    before = (folder / "k.json").read_bytes()
    assert "has the keypoints left,right" in refused("--names", "tip")
    other = [Video(n, np.arange(6.0), Frames(np.zeros((6, 12, 16, 3), np.uint8))) for n in "ab"]
    save_videos(other, folder / "w.zarr")
    assert "other frames" in refused(video="w.zarr")
    assert (folder / "k.json").read_bytes() == before
