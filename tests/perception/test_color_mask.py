"""Colour masks: the pixels of the object and no others, as evenly spread points."""

import colorsys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from muslin.core.errors import InputError
from muslin.core.frames import Frames
from muslin.core.subsets import even_subset, outermost
from muslin.perception.color_mask import ColorMaskExtractor
from muslin.perception.colour import ColourRange, object_mask

TIME = np.arange(3) / 30.0
RED, GREY = (196, 72, 50), (150, 156, 168)


def pictures(colour: tuple[int, int, int] = RED) -> np.ndarray:
    """A square of 40 x 30 pixels that moves by 10 pixels a frame on grey, and a speck of the same colour."""
    frames = np.full((3, 96, 128, 3), GREY, np.uint8)
    for t, frame in enumerate(frames):
        frame[20:50, 10 + 10 * t : 50 + 10 * t] = colour
        frame[90:93, 120:123] = colour
    return frames


def test_points_cover_the_object_and_leave_specks_out() -> None:
    found = ColorMaskExtractor(points=60).extract(pictures(), TIME)
    assert (found.unit, found.correspondence, found.points.shape) == ("px", False, (3, 60, 2))
    for t, spots in enumerate(found.points):
        np.testing.assert_allclose(spots.mean(axis=0), [29.5 + 10 * t, 34.5], atol=1.0)
        apart = np.linalg.norm(spots[:, None] - spots, axis=-1) + 99 * np.eye(60)
        assert apart.min() >= 2.0  # each stands for 20 pixels
        thirds = np.histogram2d(*spots.T, bins=(3, 3))[0]
        assert thirds.min() >= 4 and thirds.max() <= 10


def test_outermost_points_of_a_square_are_its_corners() -> None:
    frames = pictures()
    frames[:, :, 40:] = GREY  # a square of 30 is left in the first frame
    found = ColorMaskExtractor(points=4, kind="outermost").extract(frames, TIME)
    assert {tuple(p) for p in found.points[0]} == {(10.0, 20.0), (39.0, 20.0), (10.0, 49.0), (39.0, 49.0)}


def test_few_pixels_and_blank_frames_leave_gaps() -> None:
    frames = pictures()
    frames[1] = GREY
    frames[2] = GREY
    frames[2, 10:15, 10:15] = RED
    found = ColorMaskExtractor(points=60).extract(Frames(frames), TIME)
    assert found.valid.sum(axis=1).tolist() == [60, 0, 25]


def test_no_object_is_said_with_the_colours_that_are_there() -> None:
    with pytest.raises(InputError, match=r"hue 100 to 140 degrees.*pictures are grey \d+%, red 10%"):
        ColorMaskExtractor(hue=(100, 140)).extract(pictures(), TIME)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"hue": (0, 400)}, "0 to 360"),
        ({"hue": (1,)}, "two numbers"),
        ({"saturation": (0.9, 0.1)}, "least comes first"),
        ({"colour": "reddish"}, "#c44832"),
        ({"colour": (1, 2)}, "three whole numbers"),
        ({"colour": "#c44832", "hue": (0, 1)}, "not both"),
        ({"tolerance": 0.0}, "above 0"),
        ({"points": 0}, "1 or more"),
        ({"kind": "corners"}, "'outermost'"),
        ({"speck": -1}, "0 pixels or more"),
    ],
)
def test_options_that_cannot_be_are_refused(options: dict[str, object], told: str) -> None:
    with pytest.raises(InputError, match=told):
        ColorMaskExtractor(**options)  # type: ignore[arg-type]


@settings(max_examples=60)
@given(st.tuples(*[st.integers(0, 255)] * 3), st.floats(0, 360), st.floats(0, 360), st.floats(0, 1), st.floats(0, 1))
def test_a_range_holds_what_colorsys_says(
    rgb: tuple[int, int, int], low: float, high: float, a: float, b: float
) -> None:
    hue, saturation, _ = colorsys.rgb_to_hsv(*(c / 255 for c in rgb))
    hue *= 360
    near = [abs(hue - low), abs(hue - high), 360 * abs(saturation - min(a, b)), 360 * abs(saturation - max(a, b))]
    if min(near) < 0.1:
        return  # on the bound itself the last digit decides
    inside = low <= hue <= high if low <= high else hue >= low or hue <= high
    inside = inside and min(a, b) <= saturation <= max(a, b)
    found = ColourRange((low, high), (min(a, b), max(a, b)))
    assert found.mask(np.full((2, 2, 3), rgb, np.uint8)).all() == inside


@pytest.mark.parametrize("colour", [RED, (30, 160, 60), (200, 40, 60), (40, 60, 220)])
def test_a_colour_is_found_in_light_and_shade_and_nothing_else(colour: tuple[int, int, int]) -> None:
    wanted = ColourRange.around(colour, 15.0)
    for light in (1.0, 0.8, 0.5):
        shaded = tuple(int(light * c) for c in colour)
        assert object_mask(pictures(shaded), wanted)[0].sum() == 1200  # type: ignore[arg-type]
    other = tuple(colour[k] for k in (1, 2, 0))
    assert not object_mask(pictures(other), wanted).any()  # type: ignore[arg-type]


def test_a_grey_colour_is_found_by_its_brightness() -> None:
    wanted = ColourRange.around((30, 30, 30), 15.0)
    assert object_mask(pictures((40, 38, 36)), wanted)[0].sum() == 1200
    assert not object_mask(pictures((240, 240, 240)), wanted).any()


@settings(max_examples=40)
@given(st.integers(1, 80), st.integers(1, 80), st.integers(1, 50))
def test_subsets_have_their_size_and_no_point_twice(height: int, width: int, count: int) -> None:
    cells = np.argwhere(np.ones((height, width), bool))
    for choose in (even_subset, outermost):
        chosen = choose(cells, count)
        assert len(set(chosen.tolist())) == len(chosen) == min(count, len(cells))
