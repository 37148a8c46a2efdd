"""How long steps may be for motion as fast as was recorded."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from muslin.cli.main import app
from muslin.cli.pacing import halved, turning_rate
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.scenarios import preset
from muslin.core.series import PointSeries


def turning(rate: float, noise: float = 0.0, drift: float = 3.0, seed: int = 0, side: int = 5) -> Recording:
    """The 25 markers of a sheet of 0.3 m that turns about x at ``rate`` [rad/s] as it is carried along."""
    places = preset("fling").body((0.3, 0.3), (side, side)).vertices
    time = np.arange(0.0, 1.0, 0.01)
    sin, cos = np.sin(rate * time)[:, None], np.cos(rate * time)[:, None]
    x, z = places[:, 0], places[:, 2]
    points = np.stack([x + drift * time[:, None], -z * sin, z * cos], axis=2)
    points += noise * np.random.default_rng(seed).normal(size=points.shape)
    hand = np.stack([drift * time, 0 * time, 0 * time], axis=1)[:, None]
    return Recording("one", PointSeries(time, points), Motion.from_positions(time, hand))


@given(st.floats(0.0, 40.0), st.floats(-5.0, 5.0))
def test_what_turns_as_a_whole_turns_at_its_rate(rate: float, drift: float) -> None:
    """However fast it is carried along. Over 30 ms the way of a marker is a chord."""
    chord = np.sin(0.015 * rate) / (0.015 * rate) if rate > 1e-6 else 1.0
    middle = np.cos(0.015 * rate)  # its place between two frames is within the circle
    assert turning_rate(turning(rate, drift=drift)) == pytest.approx(rate * chord / middle, rel=0.02, abs=1e-6)


@pytest.mark.parametrize("noise", [0.002, 0.005])
def test_noise_is_not_taken_for_turning(noise: float) -> None:
    assert turning_rate(turning(0.0, noise)) < 6.0
    assert turning_rate(turning(20.0, noise)) == pytest.approx(21.0, abs=2.5)


def test_many_markers_tell_it_as_few_do() -> None:
    assert turning_rate(turning(20.0, side=60)) == pytest.approx(turning_rate(turning(20.0)), rel=0.02)


def test_where_it_is_not_known_nothing_turns() -> None:
    recording = turning(30.0)
    series = recording.series
    for other in (
        PointSeries(series.time, series.points, correspondence=False),
        PointSeries(series.time, series.points[..., :2], unit="px"),
        PointSeries(series.time[:2], series.points[:2]),
        PointSeries(series.time, series.points[:, :1]),
        PointSeries(series.time, np.zeros_like(series.points)),
        PointSeries(series.time, np.where(np.arange(25)[:, None] < 24, np.nan, series.points)),
    ):
        assert turning_rate(Recording("one", other)) == 0.0


@given(st.floats(0.0, 40.0), st.floats(0.01, 1.0))
def test_steps_are_halved_until_little_turns_in_them(rate: float, most: float) -> None:
    step, told = halved(0.005, most, [turning(rate), turning(0.5 * rate)])
    assert step in (0.005, 0.0025, 0.00125)
    assert told * step <= most * (1 + 1e-9) or step == 0.00125
    assert step == 0.005 or 2 * told * step > most


@pytest.mark.parametrize(
    ("rate", "simulator", "step"), [(3.0, "mujoco", None), (25.0, "mujoco", "0.0025"), (25.0, "pybullet", None)]
)
def test_a_new_study_of_fast_cloth_gets_short_steps(
    tmp_path: Path, rate: float, simulator: str, step: str | None
) -> None:
    pytest.importorskip(simulator)
    save_measurement(Measurement((turning(rate),)), tmp_path / "m.zarr")
    file = tmp_path / "study.toml"
    given = ["new", file, "--measurement", tmp_path / "m.zarr", "--scenario", "fling", "--simulator", simulator]
    done = CliRunner().invoke(app, [str(a) for a in given])
    assert done.exit_code == 0, done.output
    assert ("steps of 2.5 ms" in done.output) == (step is not None)
    lines = file.read_text().splitlines()
    assert (f"time_step = {step}" in lines) == (step is not None)
    assert ("# time_step = 0.005" in lines) == (step is None)
