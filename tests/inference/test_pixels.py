"""A study whose points are pixels: projected, fitted, compared and drawn as the camera saw them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small import TRUTH, small_config, small_measurement

from muslin.core.body import cloth_grid
from muslin.core.camera import Camera
from muslin.core.errors import InputError, RolloutFailed
from muslin.core.measurement import Measurement
from muslin.core.measurement_store import load_measurement, save_measurement
from muslin.core.scene import Scene
from muslin.core.series import PointSeries
from muslin.core.simulated_take import SimulatedTake
from muslin.core.study import Study, parse_config, write_config
from muslin.core.study.problem import build_problem
from muslin.inference.criticism.unknown.unknown import unknown
from muslin.perception.markers import MarkerExtractor

NOISE = 1.0  # [px]


def seen() -> Measurement:
    """The small cloth in the pixels of a camera."""
    measurement, rng = small_measurement(noise=0.0), np.random.default_rng(1)
    camera = Camera.framing(np.concatenate([r.series.points.reshape(-1, 3) for r in measurement.recordings]))
    taken = []
    for r in measurement.recordings:
        pixels = camera.project(r.series.points)[0]
        series = PointSeries(r.series.time, pixels + rng.normal(0, NOISE, pixels.shape), "px")
        taken.append(replace(r, series=series, camera=camera))
    return Measurement(tuple(taken))


def study_of(folder: Path, measurement: Measurement) -> Study:
    save_measurement(measurement, folder / "recording.zarr")
    write_config(parse_config(small_config(), "test"), folder / "study.toml")
    return Study.load(folder / "study.toml", workers=0)


def test_the_camera_is_kept_with_the_recording(tmp_path: Path) -> None:
    save_measurement(seen(), tmp_path / "m.zarr")
    got, given = load_measurement(tmp_path / "m.zarr").recordings[0].camera, seen().recordings[0].camera
    assert got is not None and given is not None and got.as_table() == given.as_table()


def test_pixels_without_their_camera_are_refused(tmp_path: Path) -> None:
    blind = Measurement(tuple(replace(r, camera=None) for r in seen().recordings))
    with pytest.raises(InputError, match=r"camera is not known; .* import it again with --camera FILE"):
        build_problem(parse_config(small_config(), "test"), blind)


def test_an_extractor_that_has_not_learned_is_refused_at_once() -> None:
    pytest.importorskip("monai")
    with pytest.raises(InputError, match=r"'heatmap' has not learned yet; name the file that muslin train wrote"):
        build_problem(parse_config(small_config() | {"extractor": {"name": "heatmap"}}, "test"), seen())


def test_what_lies_beyond_the_edge_keeps_its_place_and_what_lies_behind_is_not_seen() -> None:
    camera = Camera(32, 24, 30.0, 30.0, 15.5, 11.5)
    points = np.array([[[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 0.0, -1.0]]] * 2)
    scene = Scene(cloth_grid(0.2, 0.2, 4, 4), TRUTH, np.zeros(3), (), np.zeros(16))
    take = SimulatedTake(PointSeries(np.array([0.0, 1.0]), points), np.zeros((2, 16, 3)), scene, camera)
    np.testing.assert_allclose(take.projected().points[0, :2], [[15.5, 11.5], [75.5, 11.5]])
    assert not np.isfinite(take.projected().points[:, 2]).any()
    with pytest.raises(InputError, match="without a camera"):
        replace(take, camera=None).projected()


class Distracted(MarkerExtractor):
    """Misses points of what is simulated, as a detector does that looks at drawn frames."""

    def __init__(self, missed: tuple[slice, int]) -> None:
        self.missed = missed

    def observe(self, take: SimulatedTake) -> PointSeries:
        points = take.projected().points.copy()
        points[self.missed] = np.nan
        return PointSeries(take.series.time, points, "px")


def test_points_that_are_not_found_in_a_simulation_are_bridged() -> None:
    measurement = seen()
    problem = build_problem(parse_config(small_config(), "test"), measurement)
    values = {p.name: getattr(TRUTH, p.name) for p in problem.space}
    whole = problem.simulate(values, "near").series.points
    gaps = replace(problem, extractor=Distracted((slice(5, 8), 2)))
    got = gaps.simulate(values, "near").series.points
    np.testing.assert_allclose(got[4:9, 2], np.linspace(whole[4, 2], whole[8, 2], 5))  # evenly; frames are, too
    got[5:8, 2] = whole[5:8, 2]
    np.testing.assert_array_equal(got, whole)
    nowhere = replace(problem, extractor=Distracted((slice(None), 2)))
    with pytest.raises(RolloutFailed, match=r"point 2 \(from 0\) of the recording is found in none of"):
        nowhere.simulate(values, "near")
    near = measurement["near"]
    points = near.series.points.copy()
    points[:, 2] = np.nan  # nor was it in the recording
    problem.recordings["near"] = replace(near, series=replace(near.series, points=points))
    assert np.isfinite(nowhere.simulate(values, "near").series.points).all()


@pytest.mark.slow
def test_a_study_in_pixels_finds_what_one_in_metres_finds(tmp_path: Path) -> None:
    study = study_of(tmp_path, seen())
    fit = study.fit()
    assert f"noise {fit.noise.sd:.3g} px a coordinate" in fit.text()
    assert fit.noise.sd == pytest.approx(NOISE, rel=0.1)
    for (name, value), sd in zip(fit.values().items(), fit.sd, strict=True):
        assert abs(value - getattr(TRUTH, name)) < 4 * sd < 0.5 * value
    told = study.compare()
    assert {r.unit for r in told.rows} == {"px"} and " mm" not in told.text()
    held_out = next(r for r in told.rows if r.role == "held-out")
    assert held_out.rmse < 1.2 * NOISE < 0.5 * held_out.baseline
    with pytest.raises(InputError, match="points in metres"):
        unknown(study)

    pytest.importorskip("matplotlib")
    from muslin.cli.report import write_report
    from muslin.cli.report.figures_object import best_view, snapshots
    from muslin.cli.report.gather import gather

    take = gather(study).takes[0]
    shot = snapshots(take, "")[0]
    assert shot.vertices is not None and take.measured is not None
    # the mesh lies over the points, the picture's top is up
    assert np.nanmax(np.abs(shot.vertices[:, [0, 2]] - shot.measured[:, [0, 2]])) < 10 * NOISE
    np.testing.assert_allclose(shot.measured[:, 2], -take.measured[take.worst_frame, :, 1])
    np.testing.assert_allclose(best_view([shot]), [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-12)
    assert "as in the picture" in write_report(study).read_text(encoding="utf-8")
