"""The conformance kit of keypoint extractors that look at frames."""

import json
import pickle
import sys
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..arrays import FloatArray
from ..camera import Camera
from ..errors import MuslinError
from ..extractor import KeypointExtractor
from ..frames import Frames
from ..picture import Image
from ..series import PointSeries
from .checks import check_leaves_random_state, must, must_raise

MakeExtractor = Callable[..., KeypointExtractor]
Found = tuple[KeypointExtractor, PointSeries]

_HEIGHT, _WIDTH, _SIDE, _COUNT = 48, 64, 8, 10
#: Frames that are looked at, among them one in which a keypoint is missing; and points that are the same [px].
_LOOKED_AT, _SAME = 6, 1e-2


def image_checks(make: MakeExtractor) -> dict[str, Callable[[MakeExtractor], None]]:
    """The checks by title. An extractor that must learn first learns once for all of them.

    One that cannot find anything in the kit's frames, and says so, passes.
    """
    ready = cache(partial(_ready, make))
    checks = {
        "gives one series a frame, inside the picture, the same every time": check_series,
        "gives the frames' points in the frames' order": check_order,
        "finds in a few frames what it finds in many": check_batch,
        "finds the same after it was pickled": check_learned_pickles,
        "keeps what it learned in a file that runs no code": check_saved,
        "finds the same on every device": check_devices,
        "gives no point where nothing is seen": check_blank,
    }
    return {title: partial(_with_found, ready, check) for title, check in checks.items()}


def lesson() -> tuple[Frames, FloatArray]:
    """Ten annotated frames: a red and a blue square that wander, the blue one not in all of them.

    Returns:
        Frames of 48 x 64 pixels with depth and camera, and the squares' middles ``(10, 2, 2)`` [px].
    """
    rng = np.random.default_rng(5)
    rgb = np.full((_COUNT, _HEIGHT, _WIDTH, 3), 200, np.uint8)
    rgb += rng.integers(0, 20, rgb.shape, dtype=np.uint8)
    depth = np.full(rgb.shape[:3], 1.5, np.float32)
    points = np.full((_COUNT, 2, 2), np.nan)
    for t in range(_COUNT):
        for k, (left, top, colour) in enumerate(((4 + 3 * t, 4 + t, (200, 30, 30)), (44 - 2 * t, 30, (30, 30, 200)))):
            if k and t % 5 == 4:
                continue
            rgb[t, top : top + _SIDE, left : left + _SIDE] = colour
            depth[t, top : top + _SIDE, left : left + _SIDE] = 1.0
            points[t, k] = left + (_SIDE - 1) / 2, top + (_SIDE - 1) / 2
    camera = Camera(_WIDTH, _HEIGHT, 80.0, 80.0, (_WIDTH - 1) / 2, (_HEIGHT - 1) / 2)
    return Frames(rgb, depth, camera=camera), points


def _ready(make: MakeExtractor) -> Found | None:
    """An extractor that can look, having learned if it must, and what it finds; None if it finds nothing here."""
    frames, points = lesson()
    looked_at = frames[:_LOOKED_AT]
    extractor = make()
    try:
        return extractor, extractor.extract(looked_at, _times(looked_at))
    except MuslinError:
        extractor = _with_options(make, extractor.quick)
        extractor.fit(frames, points)
    try:
        return extractor, extractor.extract(looked_at, _times(looked_at))
    except MuslinError:
        return None


def _with_found(
    ready: Callable[[], Found | None], check: Callable[[MakeExtractor, Found], None], make: MakeExtractor
) -> None:
    found = ready()
    if found is not None:
        check(make, found)


def _with_options(make: MakeExtractor, options: Any) -> KeypointExtractor:
    """An extractor with further options, where what makes it takes them."""
    try:
        return make(**options)
    except TypeError:
        return make()


def check_series(make: MakeExtractor, found: Found) -> None:
    """One series a frame, in the picture where it is in pixels; frames and random generators stay as they were."""
    extractor, first = found
    frames = lesson()[0][:_LOOKED_AT]
    before = frames.rgb.copy()
    got: list[PointSeries] = []
    check_leaves_random_state(lambda: got.append(extractor.extract(frames, _times(frames))))
    must(isinstance(first, PointSeries), f"extract gives a {type(first).__name__}, not a PointSeries")
    must(np.array_equal(first.time, _times(frames)), "the time of the frames has changed")
    must(np.array_equal(frames.rgb, before), "the frames were changed")
    must(np.array_equal(first.points, got[0].points, equal_nan=True), "the same frames give other points")
    if first.unit == "px":
        must(first.points.shape[2] == 2, f"points in pixels have {first.points.shape[2]} coordinates, not 2")
        seen = first.points[first.valid]
        inside = (seen >= -0.5) & (seen <= [_WIDTH - 0.5, _HEIGHT - 0.5])
        must(inside.all(), "a point lies outside of the picture")


def check_order(make: MakeExtractor, found: Found) -> None:
    """Frames in another order give the points in that order."""
    extractor, first = found
    order = np.array([3, 0, 5, 1, 4, 2])
    frames = lesson()[0][order]
    got = extractor.extract(frames, _times(frames)).points
    _same(got, first.points[order], "frames in another order give other points, not the same in that order")


def check_batch(make: MakeExtractor, found: Found) -> None:
    """A frame's points do not depend on how many frames come with it."""
    extractor, first = found
    for k in range(0, _LOOKED_AT, 2):
        few = lesson()[0][k : k + 2]
        try:
            got = extractor.extract(few, _times(few)).points
        except MuslinError:
            got = np.full_like(first.points[k : k + 2], np.nan)
        _same(got, first.points[k : k + 2], "two frames alone give other points than among more")


def check_learned_pickles(make: MakeExtractor, found: Found) -> None:
    """What it learned travels to worker processes with it."""
    frames = lesson()[0][:_LOOKED_AT]
    copy: KeypointExtractor = pickle.loads(pickle.dumps(found[0]))
    _same(copy.extract(frames, _times(frames)).points, found[1].points, "a pickled copy finds other points")


def check_saved(make: MakeExtractor, found: Found) -> None:
    """Where it has ``save``: the file is safetensors, gives the same extractor, and a damaged one is refused."""
    save = getattr(found[0], "save", None)
    if save is None:
        return
    frames = lesson()[0][:_LOOKED_AT]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "kit.safetensors"
        save(path)
        data = path.read_bytes()
        length = int.from_bytes(data[:8], "little")
        try:
            json.loads(data[8 : 8 + length])
        except ValueError as error:
            raise AssertionError("the file is no safetensors file: its header is not JSON") from error
        again = make(weights=str(path))
        _same(again.extract(frames, _times(frames)).points, found[1].points, "made from its file it finds other points")
        path.write_bytes(data[: len(data) // 2])
        must_raise(MuslinError, lambda: make(weights=str(path)), "half of its file is taken without a complaint")
        missing = str(path.with_name("none.safetensors"))
        must_raise(MuslinError, lambda: make(weights=missing), "a file that is not there is taken without a complaint")


def check_devices(make: MakeExtractor, found: Found) -> None:
    """An extractor with an option ``device`` finds the same on the processor and, where torch sees one, on a GPU."""
    save = getattr(found[0], "save", None)
    if save is None or not hasattr(found[0], "device"):
        return
    torch = cast(Any, sys.modules.get("torch"))
    frames = lesson()[0][:_LOOKED_AT]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "kit.safetensors"
        save(path)
        for device in ("cpu", "cuda") if torch is not None and torch.cuda.is_available() else ("cpu",):
            there = make(weights=str(path), device=device).extract(frames, _times(frames)).points
            _same(there, found[1].points, f"on {device} it finds other points", 0.5)


def check_blank(make: MakeExtractor, found: Found) -> None:
    """Where it says that it reports what is not seen, a frame of one colour gives no point."""
    if not found[0].reports_unseen:
        return
    frames = lesson()[0][:_LOOKED_AT]
    rgb: Image = frames.rgb.copy()
    rgb[2] = 128
    got = found[0].extract(Frames(rgb), _times(frames)).points
    must(not np.isfinite(got[2]).any(), "it gives points for a frame of one colour, in which nothing can be seen")


def _times(frames: Frames) -> FloatArray:
    return np.asarray(0.1 * np.arange(len(frames)), float)


def _same(got: FloatArray, wanted: FloatArray, complaint: str, within: float = _SAME) -> None:
    must(got.shape == wanted.shape, f"{complaint}: shape {got.shape}, not {wanted.shape}")
    must(np.allclose(got, wanted, rtol=0.0, atol=within, equal_nan=True), complaint)
