"""The page of ``muslin annotate`` in a real browser: what is clicked is what is kept. Skipped without Chromium."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from annotate_process import Page as Process
from playwright.sync_api import Browser, Page, expect, sync_playwright

from muslin.core.annotations import ABSENT, HIDDEN, SEEN, UNDECIDED
from muslin.core.frames import Frames, Video
from muslin.core.keypoints_coco import read_coco
from muslin.core.video_store import save_videos

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
SIZE = (24, 32)
#: Where the one magenta pixel of frame k, black elsewhere, is (u, v) [px].
SPOT = [(3, 5), (20, 11), (31, 0), (0, 23)]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as play:
        made = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield made
        made.close()


@pytest.fixture
def process(tmp_path: Path) -> Iterator[Process]:
    rgb = np.zeros((len(SPOT), *SIZE, 3), np.uint8)
    for k, (u, v) in enumerate(SPOT):
        rgb[k, v, u] = (255, 0, 255)
    save_videos([Video("dark", np.arange(float(len(SPOT))), Frames(rgb))], tmp_path / "v.zarr")
    made = Process(tmp_path, "--names", "left,right", "--every", "1")
    yield made
    if made.process.poll() is None:
        made.process.kill()
    made.process.communicate()


@pytest.fixture
def page(browser: Browser, process: Process) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 1000, "height": 700})
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(process.url.geturl())
    expect(page.locator("#share")).to_have_text("0 of 4 frames")
    yield page
    context.close()
    assert not errors


def spot(page: Page) -> tuple[float, float]:
    """Where the magenta pixel is drawn on the canvas: the middle of its square [CSS px]."""
    page.evaluate("view.picture(model.frame).decode().then(() => view.draw())")
    shot = cv2.imdecode(np.frombuffer(page.locator("#picture").screenshot(), np.uint8), cv2.IMREAD_COLOR)
    rows, columns = np.nonzero((np.abs(shot.astype(int) - (255, 0, 255)) < 6).all(axis=2))
    return float(columns.min() + columns.max() + 1) / 2, float(rows.min() + rows.max() + 1) / 2


def click(page: Page, place: tuple[float, float], **more: str) -> None:
    page.locator("#picture").click(position={"x": place[0], "y": place[1]}, **more)  # type: ignore[arg-type]


def saved(page: Page, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points and flags of the file, once the page says that all is saved."""
    expect(page.locator("#saved")).to_have_text("saved")
    kept = read_coco(folder / "k.json")
    return kept.points, kept.flags


def test_a_click_keeps_the_pixel_that_is_seen_there(page: Page, tmp_path: Path) -> None:
    for k, place in enumerate(SPOT):
        click(page, spot(page))
        points, flags = saved(page, tmp_path)
        np.testing.assert_allclose(points[k, 0], place, atol=0.05)
        assert flags[k].tolist() == [SEEN, UNDECIDED]
        page.keyboard.press("ArrowRight")


def test_a_zoomed_picture_keeps_the_same_pixel(page: Page, tmp_path: Path) -> None:
    x, y = spot(page)
    before = page.evaluate("view.scale")
    page.locator("#picture").hover(position={"x": x + 40, "y": y + 40})
    page.mouse.wheel(0, -400)
    page.evaluate("new Promise(requestAnimationFrame)")
    assert page.evaluate("view.scale") > 1.5 * before
    click(page, spot(page))
    np.testing.assert_allclose(saved(page, tmp_path)[0][0, 0], SPOT[0], atol=0.05)


def test_keys_mark_copy_undo_and_move_on(page: Page, tmp_path: Path) -> None:
    click(page, spot(page))
    page.keyboard.press("x")
    assert saved(page, tmp_path)[1][0].tolist() == [SEEN, ABSENT]
    expect(page.locator("#share")).to_have_text("1 of 4 frames")
    page.keyboard.press("ArrowRight")
    expect(page.locator("#frame")).to_have_text("dark, frame 1 (2 of 4)")
    click(page, spot(page), button="right")
    page.keyboard.press("c")  # of the frame before: takes the place of what was marked
    points, flags = saved(page, tmp_path)
    np.testing.assert_array_equal(points[1], points[0])
    page.keyboard.press("z")
    points, flags = saved(page, tmp_path)
    np.testing.assert_allclose(points[1, 0], SPOT[1], atol=0.05)
    assert flags[1].tolist() == [HIDDEN, UNDECIDED]
    page.keyboard.press("Shift+Z")
    assert saved(page, tmp_path)[1][1].tolist() == [SEEN, ABSENT]
    page.keyboard.press("n")
    expect(page.locator("#frame")).to_have_text("dark, frame 2 (3 of 4)")
    page.keyboard.press("d")  # without a mouse: a cross from the middle, placed
    page.keyboard.press("Shift+W")
    page.keyboard.press("Enter")
    np.testing.assert_allclose(saved(page, tmp_path)[0][2, 0], [SIZE[1] / 2 + 0.5, SIZE[0] / 2 - 10.5])


def test_a_keypoint_is_dragged_and_one_undo_takes_it_back(page: Page, tmp_path: Path) -> None:
    x, y = spot(page)
    click(page, (x, y))
    step = page.evaluate("view.scale")
    box = page.locator("#picture").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + x, box["y"] + y)
    page.mouse.down()
    for k in range(1, 6):
        page.mouse.move(box["x"] + x + k * step, box["y"] + y)
    page.mouse.up()
    np.testing.assert_allclose(saved(page, tmp_path)[0][0, 0], np.add(SPOT[0], (5, 0)), atol=0.1)
    page.keyboard.press("z")
    np.testing.assert_allclose(saved(page, tmp_path)[0][0, 0], SPOT[0], atol=0.05)


def test_opened_again_it_goes_on_at_the_first_frame_that_is_not_finished(page: Page, tmp_path: Path) -> None:
    click(page, spot(page))
    page.keyboard.press("x")
    saved(page, tmp_path)
    address = page.url.partition("#")[0]
    page.goto("about:blank")
    page.goto(address)
    expect(page.locator("#share")).to_have_text("1 of 4 frames")
    expect(page.locator("#frame")).to_have_text("dark, frame 1 (2 of 4)")


def test_a_second_tab_cannot_overwrite_the_first(page: Page, process: Process, tmp_path: Path) -> None:
    other = page.context.new_page()
    other.goto(process.url.geturl())
    expect(other.locator("#share")).to_have_text("0 of 4 frames")
    click(page, spot(page))
    saved(page, tmp_path)
    click(other, (300.0, 300.0))
    expect(other.locator("#banner")).to_contain_text("In another tab dark/0 was changed")
    np.testing.assert_allclose(saved(other, tmp_path)[0][0, 0], SPOT[0], atol=0.05)
    other.locator("#banner button").click()
    other.keyboard.press("z")  # brings its own back
    assert abs(saved(other, tmp_path)[0][0, 0] - SPOT[0]).max() > 1


def test_points_wait_on_the_page_while_muslin_does_not_answer(page: Page, tmp_path: Path) -> None:
    page.route("**/points", lambda route: route.abort())
    click(page, spot(page))
    expect(page.locator("#banner")).to_contain_text("Not saved")
    expect(page.locator("#saved")).to_have_text("not saved")
    assert not (tmp_path / "k.json").exists()
    page.unroute("**/points")
    np.testing.assert_allclose(saved(page, tmp_path)[0][0, 0], SPOT[0], atol=0.05)
    expect(page.locator("#banner")).to_be_hidden()


def test_done_says_what_comes_next_and_ends_the_command(page: Page, process: Process, tmp_path: Path) -> None:
    for _ in SPOT:
        click(page, spot(page))
        page.keyboard.press("x")
        page.keyboard.press("ArrowRight")
    expect(page.locator("#hint")).to_have_text("All frames are annotated: Done")
    expect(page.locator("#saved")).to_have_text("saved")
    page.locator("#done").click()
    expect(page.locator("#command")).to_have_text("muslin train heatmap v.zarr --annotations k.json -o k.safetensors")
    status, out, error = process.end()
    assert (status, error) == (0, "") and "4 of 4 frames annotated" in out
    assert len(json.loads((tmp_path / "k.json").read_text())["annotations"]) == len(SPOT)
