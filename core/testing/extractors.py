"""The conformance kit of keypoint extractors."""

from collections.abc import Callable
from functools import partial

import numpy as np

from ..errors import MuslinError
from ..extractor import KeypointExtractor
from ..series import PointSeries
from .checks import Check, check_leaves_random_state, check_pickles, must, must_raise, raise_failures
from .image_extractors import image_checks

MakeExtractor = Callable[..., KeypointExtractor]

_TIME = np.linspace(0.0, 0.4, 5)


def check_extractor(make: MakeExtractor) -> None:
    """Hold an extractor against everything that muslin relies on.

    Args:
        make: builds the extractor; its class, if all options have defaults. One that learns is also made with its
            ``quick`` options, and anew with the option ``weights``.

    Raises:
        AssertionError: lists every broken promise.
    """
    raise_failures("the extractor", extractor_checks(make))


def extractor_checks(make: MakeExtractor) -> list[Check]:
    """The checks of :func:`check_extractor`, one a promise."""
    checks: dict[str, Callable[[MakeExtractor], None]] = {
        "declares itself": check_declares,
        "survives pickle": check_pickled,
    }
    if make().needs_images:
        checks["finds points in images, or says that it must learn first"] = check_images
        checks |= image_checks(make)
    else:
        checks |= {
            "takes points": check_points,
            "keeps points that were not seen apart": check_gaps,
            "refuses images": check_refuses_images,
        }
    return [Check(title, partial(check, make)) for title, check in checks.items()]


def check_declares(make: MakeExtractor) -> None:
    """Name and need of images are declared."""
    extractor = make()
    must(isinstance(extractor, KeypointExtractor), f"{type(extractor).__name__} is not a muslin.core KeypointExtractor")
    must(isinstance(extractor.name, str) and extractor.name, "name must be a text")
    must(isinstance(extractor.needs_images, bool), "needs_images must be true or false")


def check_pickled(make: MakeExtractor) -> None:
    """It travels to worker processes."""
    copy = check_pickles(make(), "the extractor")
    must(type(copy) is type(make()), "a pickled copy is of another class")


def check_points(make: MakeExtractor) -> None:
    """Points come out one series a frame, the same every time, and the input stays as it was."""
    series = _series()
    before = series.points.copy()
    got: list[PointSeries] = []
    check_leaves_random_state(lambda: got.append(make().extract(series, series.time)))
    first, again = got[0], make().extract(series, series.time)
    must(isinstance(first, PointSeries), f"extract gives a {type(first).__name__}, not a PointSeries")
    must(np.array_equal(first.time, series.time), "the time of the frames has changed")
    must(first.unit == "m", f"points in metres came out in {first.unit}")
    must(np.array_equal(first.points, again.points, equal_nan=True), "the same input gives other points")
    must(np.array_equal(series.points, before, equal_nan=True), "the input was changed")


def check_gaps(make: MakeExtractor) -> None:
    """A frame in which no point was seen yields no point; nothing is made up."""
    series = _series()
    points = series.points.copy()
    points[2] = np.nan
    got = make().extract(PointSeries(series.time, points), series.time)
    must(not np.isfinite(got.points[2]).any(), "it gives points for a frame in which none was seen")


def check_refuses_images(make: MakeExtractor) -> None:
    """Frames are refused with a message where points are needed."""
    frames = np.zeros((5, 24, 32, 3), np.uint8)
    must_raise(MuslinError, lambda: make().extract(frames, _TIME), "it takes images, but needs_images is false")


def check_images(make: MakeExtractor) -> None:
    """Frames give pixels inside the picture; an extractor that learns may ask for fit first."""
    rng = np.random.default_rng(0)
    frames = rng.integers(0, 255, (5, 48, 64, 3), dtype=np.uint8)
    before = frames.copy()
    try:
        got = make().extract(frames, _TIME)
    except MuslinError:
        return
    must(isinstance(got, PointSeries), f"extract gives a {type(got).__name__}, not a PointSeries")
    must(np.array_equal(got.time, _TIME), "the time of the frames has changed")
    must(np.array_equal(frames, before), "the frames were changed")
    if got.unit == "px":
        seen = got.points[got.valid][:, :2]
        must(((seen >= -0.5) & (seen <= [63.5, 47.5])).all(), "a point lies outside the picture")


def _series() -> PointSeries:
    rng = np.random.default_rng(1)
    points = rng.normal(0, 0.1, (len(_TIME), 6, 3))
    points[1, 2] = np.nan
    return PointSeries(_TIME, points)
