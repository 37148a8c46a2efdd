"""What results of a study depend on beside its numbers: the camera, and files that it names."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from muslin.core.camera import Camera
from muslin.core.errors import InputError
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.registry import REGISTRY
from muslin.core.scenarios import preset
from muslin.core.series import PointSeries
from muslin.core.study import Study
from muslin.core.testing.reference import ReferenceSimulator
from muslin.perception.markers import MarkerExtractor


class Learned(MarkerExtractor):
    def __init__(self, *, weights: str) -> None:
        assert Path(weights).is_file()
        super().__init__()


@pytest.fixture(autouse=True)
def plugins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(REGISTRY._objects, ("simulator", "reference"), ReferenceSimulator)
    monkeypatch.setitem(REGISTRY._objects, ("extractor", "learned"), Learned)


CAMERA = Camera(320, 240, 400.0, 400.0, 160.0, 120.0, np.array([0.0, -1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))


def study_in(folder: Path, camera: Camera = CAMERA, **extractor: Any) -> Study:
    folder.mkdir(exist_ok=True)
    body = preset("fling").body(vertices=[3, 3])
    series = PointSeries(np.linspace(0, 0.1, 4), np.tile(body.vertices[:, :2], (4, 1, 1)), "px")
    save_measurement(Measurement((Recording("a", series, camera=camera),)), folder / "m.zarr")
    tail = "".join(f"{name} = {value!r}\n" for name, value in extractor.items())
    (folder / "study.toml").write_text(
        '[study]\nmeasurement = "m.zarr"\n[scenario]\nname = "fling"\nvertices = [3, 3]\n'
        '[simulator]\nname = "reference"\n[estimator]\nname = "npe-rkhs"\n' + (f"[extractor]\n{tail}" if tail else "")
    )
    return Study.load(folder / "study.toml")


def test_another_camera_is_another_measurement(tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    longer = study_in(two, replace(CAMERA, fx=800.0, fy=800.0))
    assert study_in(one).fingerprint() != longer.fingerprint()


def test_weights_that_were_learned_anew_are_another_study_and_go_along_with_an_effect(tmp_path: Path) -> None:
    weights = tmp_path / "corners.bin"
    weights.write_bytes(b"one")
    study = study_in(tmp_path, name="learned", weights="corners.bin")
    before = study.fingerprint()
    assert before == study.fingerprint()
    weights.write_bytes(b"two")
    assert study.fingerprint() != before
    (tmp_path / "elsewhere").mkdir()
    better = study.add("viscous-damping", tmp_path / "elsewhere" / "study.toml")
    assert Path(better.config.extractor.options["weights"]) == weights.resolve()
    assert Study.load(better.path).problem.extractor.ready


@pytest.mark.parametrize("results", ["m.zarr", "./x/../m.zarr", "m.zarr/out.zarr", "."])
def test_results_do_not_go_where_the_measurement_is(tmp_path: Path, results: str) -> None:
    (tmp_path / "x").mkdir()
    file = study_in(tmp_path).path
    file.write_text(file.read_text().replace("[scenario]", f'results = "{results}"\n[scenario]'))
    with pytest.raises(InputError, match=r"give each a place of its own: name another in \[study\] results"):
        Study.load(file)


def test_results_do_not_go_into_a_store_of_something_else(tmp_path: Path) -> None:
    file = study_in(tmp_path).path
    (tmp_path / "n.zarr").symlink_to(study_in(tmp_path / "other").measurement_path)
    file.write_text(file.read_text().replace("[scenario]", 'results = "n.zarr"\n[scenario]'))
    with pytest.raises(InputError, match="is a measurement, not a store of results"):
        Study.load(file).results("r+")
