"""Recordings in pieces that start as measured."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.core.errors import InputError
from muslin.core.measurement import Recording
from muslin.core.motion import Motion
from muslin.core.scenarios import preset
from muslin.core.series import PointSeries
from muslin.core.study.config import parse_config
from muslin.core.study.windows import cut_all, cut_up, joined


def take(frames: int) -> Recording:
    time = 3.0 + 0.01 * np.arange(frames)
    points = np.random.default_rng(0).normal(size=(frames, 4, 3))
    return Recording("swing", PointSeries(time, points), Motion.still(2), motion="both")


@given(st.integers(30, 600), st.floats(0.15, 20.0))
def test_pieces_are_the_whole_recording_in_order(frames: int, length: float) -> None:
    whole = take(frames)
    found = cut_up(whole, length)
    np.testing.assert_array_equal(np.concatenate([p.series.time for p in found]), whole.series.time)
    np.testing.assert_array_equal(np.concatenate([p.series.points for p in found]), whole.series.points)
    assert len({p.name for p in found}) == len(found) == max(1, round(0.01 * (frames - 1) / length))
    sizes = [p.series.frames for p in found]
    assert max(sizes) - min(sizes) <= 2
    assert all(p.gripper is whole.gripper for p in found)


def test_a_piece_starts_in_a_frame_that_shows_every_point() -> None:
    whole = take(100)
    whole.series.points[48:55, 2] = np.nan
    first, second = cut_up(whole, 0.5)
    assert second.series.time[0] == pytest.approx(3.55)
    assert np.isfinite(second.series.points[0]).all()
    assert first.series.frames == 55
    assert (first.name, second.name) == ("swing from 0 s", "swing from 0.55 s")
    assert (first.motion, second.motion) == ("both from 0 s", "both from 0.55 s")


@pytest.mark.parametrize("length", [0.05, 0.09])
def test_pieces_that_would_be_too_short_are_refused(length: float) -> None:
    with pytest.raises(InputError, match=r"study\.window.*'swing' has pieces of fewer than 10 frames"):
        cut_up(take(100), length)


def test_a_recording_that_never_shows_every_point_is_refused() -> None:
    whole = take(100)
    whole.series.points[:, 1] = np.nan
    with pytest.raises(InputError, match="start the recording where all points are seen"):
        cut_up(whole, 0.5)


def test_only_what_starts_as_measured_is_cut() -> None:
    table = {
        "study": {"measurement": "m.zarr", "window": 1.0},
        "scenario": {"name": "cable"},
        "simulator": {"name": "mujoco"},
    }
    with pytest.raises(InputError, match="needs \\[scenario\\] start = 'measured'"):
        parse_config(table, "study.toml")
    table["scenario"]["start"] = "measured"  # type: ignore[index]
    assert parse_config(table, "study.toml").study.window == 1.0


def test_pieces_of_a_recording_become_one_again() -> None:
    whole, other = take(100), replace(take(60), name="other")
    hidden = replace(whole.series, points=np.where(np.arange(100)[:, None, None] < 7, np.nan, whole.series.points))
    pieces, of = cut_all([replace(whole, series=hidden), other], 0.5)
    base = preset("cable").scenario()
    scenarios = {r.name: base.for_recording(r) for r in (*pieces, whole)}
    found = joined(scenarios, {name: f"{r.name}, cut" for name, r in of.items()})
    assert list(found) == ["swing, cut", "other, cut", "swing"]
    np.testing.assert_array_equal(found["swing, cut"].times, whole.series.time[7:])  # nothing is fitted before
    np.testing.assert_array_equal(found["swing"].times, whole.series.time)
    assert all(s.motion is whole.gripper or s.motion is other.gripper for s in found.values())
    assert cut_all([whole, other], None) == ([whole, other], {})
