import shutil
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from muslin.core.errors import InputError, MuslinError
from muslin.core.measurement import Measurement, Recording, repeats
from muslin.core.measurement_store import load_measurement, read_hidden, save_measurement
from muslin.core.motion import Motion
from muslin.core.series import PointSeries


def take(name: str = "a", **changes: object) -> Recording:
    rng = np.random.default_rng(3)
    points = rng.normal(size=(6, 4, 3))
    points[2, 1] = np.nan
    series = PointSeries(np.linspace(0, 0.5, 6), points)
    return Recording(name, series, **changes)  # type: ignore[arg-type]


@st.composite
def recordings(draw: st.DrawFn, name: str, unit: str) -> Recording:
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    frames, count = draw(st.integers(2, 5)), draw(st.integers(1, 4))
    points = rng.normal(size=(frames, count, 2 if unit == "px" else 3))
    points[rng.random((frames, count)) < draw(st.floats(0, 0.5))] = np.nan
    points[0, 0] = 1.0
    time = draw(st.floats(-10, 10)) + np.cumsum(rng.uniform(0.01, 1.0, frames))
    gripper = None
    if draw(st.booleans()):
        steps = draw(st.integers(1, 4))
        turns = rng.normal(size=(steps, 2, 4))
        turns /= np.linalg.norm(turns, axis=2, keepdims=True)
        gripper = Motion(np.arange(steps) * 0.1, np.concatenate([rng.normal(size=(steps, 2, 3)), turns], axis=2))
    series = PointSeries(time, points, unit, draw(st.booleans()))  # type: ignore[arg-type]
    return Recording(name, series, gripper, draw(st.sampled_from(["", "fling"])), draw(st.floats(0, 5)))


@settings(max_examples=15)
@given(st.data())
def test_round_trip(data: st.DataObject) -> None:
    unit = data.draw(st.sampled_from(["m", "px"]))
    names = data.draw(st.lists(st.sampled_from(["a", "take 2", "é-ü", "x.y", "b (1)"]), min_size=1, unique=True))
    before = Measurement(tuple(data.draw(recordings(n, unit)) for n in names))
    with TemporaryDirectory() as folder:
        save_measurement(before, Path(folder) / "m.zarr")
        after = load_measurement(Path(folder) / "m.zarr")
    assert after.names == before.names
    for a, b in zip(before.recordings, after.recordings, strict=True):
        assert np.array_equal(a.series.points, b.series.points, equal_nan=True)
        assert np.array_equal(a.series.time, b.series.time)
        assert (a.series.unit, a.series.correspondence, a.motion, a.load) == (
            b.series.unit,
            b.series.correspondence,
            b.motion,
            b.load,
        )
        assert (a.gripper is None) == (b.gripper is None)
        if a.gripper is not None and b.gripper is not None:
            assert np.array_equal(a.gripper.poses, b.gripper.poses)
            assert np.array_equal(a.gripper.times, b.gripper.times)


def test_xarray_opens_it_with_units_and_dimensions(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    save_measurement(Measurement((take(gripper=Motion.still()),)), tmp_path / "m.zarr")
    with xarray.open_zarr(tmp_path / "m.zarr", group="a", consolidated=False) as data:
        assert data["points"].dims == ("time", "point", "axis")
        assert data["points"].attrs["units"] == "m"
        assert data["gripper_pose"].dims == ("gripper_time", "gripper", "pose")
        assert data.sizes["time"] == 6
        assert np.isnan(data["points"].values[2, 1]).all()
        assert data.attrs["correspondence"]


def test_the_hidden_label_is_read_only_when_asked(tmp_path: Path) -> None:
    save_measurement(Measurement((take(),)), tmp_path / "m.zarr", hidden={"effect": "wind"})
    assert read_hidden(tmp_path / "m.zarr") == {"effect": "wind"}
    assert "wind" not in repr(load_measurement(tmp_path / "m.zarr"))


def test_repeats_share_motion_and_load() -> None:
    takes = (take("a", motion="f"), take("b", motion="f"), take("c", motion="f", load=0.1), take("d"))
    assert [(a.name, b.name) for a, b in repeats(takes)] == [("a", "b")]


@pytest.mark.parametrize("name", ["", "a/b", "..", ".hidden", "__x", "a\\b", "line\nbreak", "zarr.json"])
def test_names_that_cannot_be_folders(name: str) -> None:
    with pytest.raises(InputError, match=r"name"):
        take(name)


@pytest.mark.parametrize("load", [-1.0, float("nan"), float("inf")])
def test_loads_that_cannot_be(load: float) -> None:
    with pytest.raises(InputError, match="load must be finite and not negative"):
        take(load=load)


def test_measurements_that_cannot_be() -> None:
    with pytest.raises(InputError, match="at least one"):
        Measurement(())
    with pytest.raises(InputError, match="named twice: a"):
        Measurement((take(), take()))
    pixels = Recording("p", PointSeries(np.array([0.0, 1.0]), np.ones((2, 1, 2)), "px"))
    with pytest.raises(InputError, match="share a unit"):
        Measurement((take(), pixels))
    with pytest.raises(InputError, match="no recording 'z'"):
        Measurement((take(),))["z"]


def test_points_without_correspondence_need_every_coordinate() -> None:
    flat = np.ones((3, 5, 3))
    flat[:, :, 1] = np.nan
    PointSeries(np.arange(3.0), flat)
    with pytest.raises(InputError, match="no point has all its coordinates"):
        PointSeries(np.arange(3.0), flat, correspondence=False)


def test_a_damaged_store_is_told(tmp_path: Path) -> None:
    whole = tmp_path / "m.zarr"
    save_measurement(Measurement((take(gripper=Motion.still()),)), whole)
    files = sorted(p.relative_to(whole) for p in whole.rglob("*") if p.is_file())
    files = [f for f in files if "axis" not in f.parts]  # for other readers only
    assert len(files) > 8
    for file in files:
        for damage in (b"", b"\x00garbage", b"{}"):
            broken = tmp_path / "broken.zarr"
            shutil.copytree(whole, broken)
            (broken / file).write_bytes(damage)
            with pytest.raises(MuslinError) as caught:
                load_measurement(broken)
            assert "broken.zarr" in str(caught.value), (file, damage)
            shutil.rmtree(broken)


@pytest.mark.parametrize("spoil", [lambda c: c.unlink(), lambda c: c.write_bytes(c.read_bytes()[:5])])
def test_damage_is_told_with_one_cause_and_one_next_step(tmp_path: Path, spoil: Callable[[Path], object]) -> None:
    path = tmp_path / "m.zarr"
    save_measurement(Measurement((take(),)), path)
    spoil(path / "a" / "points" / "c" / "0" / "0" / "0")
    with pytest.raises(InputError) as caught:
        load_measurement(path)
    told = str(caught.value)
    assert told.startswith(f"{path}, recording 'a' is damaged (")
    assert told.endswith("); import it again")
    assert told.count("damaged") == 1 and "run the fit" not in told
