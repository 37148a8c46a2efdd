"""The report, at every stage a study can be in."""

import base64
import json
import re
import sys
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from made_up_study import ROLES, make_study
from matplotlib.figure import Figure
from report_page import Page, page_of

from muslin.cli import steps
from muslin.cli.report import overview_figure, write_report
from muslin.cli.report.compared import distance
from muslin.cli.report.figures_object import snapshots
from muslin.cli.report.gather import gather
from muslin.cli.report.predictive import predictive_data
from muslin.cli.report.style import look, new_figure, png
from muslin.cli.report.words import spread
from muslin.core.errors import MissingFileError, MuslinError, StepMissingError, StoreError
from muslin.core.store import storage_errors
from muslin.core.study.study import Study


def test_what_reaches_beyond_a_figure_is_in_its_picture() -> None:
    """As a title of two lines does above axes of equal scales."""
    with look():
        figure = new_figure(3.0, 1.0)
        figure.text(0.5, 1.1, "above", va="bottom")
        picture = cv2.imdecode(np.frombuffer(png(figure, 100), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    ink = np.flatnonzero(picture.min(axis=1) < 128)
    assert 0 < ink[0] < ink[-1] < len(picture) - 1


def test_nothing_fitted_says_so(tmp_path: Path) -> None:
    with pytest.raises(StepMissingError, match="muslin fit"):
        write_report(make_study(tmp_path))
    assert not list(tmp_path.glob("*.html"))


def test_after_fit_only(tmp_path: Path) -> None:
    page = page_of(make_study(tmp_path, "fit"))
    assert page.sections == ["fit", "provenance", "hidden"]
    assert page.figures["svg"] == 3 + 1  # marginals, pairs
    assert "has not been checked yet" in page.text
    assert "muslin compare cloth.toml" in page.text
    assert "at a bound of its prior" in page.text
    assert "3 of 240 draws could not be simulated" in page.text


def test_after_compare(tmp_path: Path) -> None:
    page = page_of(make_study(tmp_path, "fit", "compare", hidden=False))
    assert page.sections == [
        "object", "predictive", "error", "recordings", "where", "points", "sets", "adequate", "fit", "provenance"
    ]  # fmt: skip
    assert page.figures["img"] == 3 + 3 + 3 and page.figures["canvas"] == 2  # objects, maps, sets
    assert page.figures["svg"] == 3 + 3 + 1 + 3 + 1  # error, points, signs, marginals, pairs
    assert "three quarters arises along the free edge" in page.text
    assert "does not explain the recordings" in page.text
    assert "muslin diagnose cloth.toml" in page.text


def test_after_everything(tmp_path: Path) -> None:
    study = make_study(tmp_path, "fit", "compare", "diagnose")
    page = page_of(study)
    assert page.sections == [
        "object", "predictive", "error", "recordings", "where", "points", "sets", "adequate", "candidates", "fit",
        "provenance", "hidden",
    ]  # fmt: skip
    assert re.search(
        r"Air drag is missing .* held-out error falls from \d+ mm to 3\.\d mm \(noise 3\.0 mm\)", page.text
    )
    assert "moves too fast through the air in the model" in page.text
    assert "drag coefficient 1.19 ± 0.09" in page.text
    assert "240 fit + 352 diagnosis" in page.text
    assert "neither found nor ruled out: actuator lag" in page.text
    assert page.text.index("the fit never saw it") > page.text.index("Made by")
    assert (tmp_path / "cloth.report.html").stat().st_size < 3e6


def test_pieces_that_were_fitted_are_told_of(tmp_path: Path) -> None:
    study = make_study(tmp_path, "fit", "compare")
    told = "Fitted recordings are predicted in pieces (5 of each, in the mean)"
    assert told not in page_of(study).text
    study.results("r+")["compare"].attrs["in_pieces"] = told
    assert told in page_of(study).text


def test_a_second_study_is_the_after(tmp_path: Path) -> None:
    study = make_study(tmp_path, "fit", "compare", "diagnose")
    page = page_of(study, make_study(tmp_path, "fit", "compare", drag=True))
    assert "air drag: drag coefficient" in page.text and "not in the model" in page.text
    assert "muslin add air-drag cloth.toml -o cloth-with-air-drag.toml" in page.text
    assert page.figures["svg"] == 3 + 3 + 1 + 4 + 1


@pytest.mark.parametrize("state", ["compared and changed", "fitted", "empty", "new"])
def test_an_after_that_has_nothing_to_show_is_refused(tmp_path: Path, state: str) -> None:
    study = make_study(tmp_path, "fit", "compare", "diagnose")
    steps = {"compared and changed": ("fit", "compare"), "fitted": ("fit",)}.get(state, ())
    after = make_study(tmp_path, *steps, drag=True)
    if steps == ("fit", "compare"):
        after.config.study.seed += 1
    if state == "new":
        after.results_path.rename(tmp_path / "gone.zarr")
    told = r"has not been compared.* muslin fit \S+drag\.toml && muslin compare"
    with pytest.raises(StepMissingError, match=told):
        write_report(study, after=after)
    assert not list(tmp_path.glob("*.html"))


def test_self_contained_and_escaped(tmp_path: Path) -> None:
    study = make_study(tmp_path, "fit", "compare", "diagnose")
    html = write_report(study).read_text(encoding="utf-8")
    page = Page(html)
    assert all(a.startswith(("data:image/png;base64,", "#")) for a in page.addresses)
    assert not re.search(r"https?:|@import|url\((?!#)", html)
    assert "<b>&\"2'" not in html and "swing &lt;b&gt;&amp;&#34;2&#39;" in html
    assert "<i>" not in html and "&lt;i&gt;" in html
    assert not page.open
    ids = re.findall(r' id="([^"]+)"', html)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r"url\(#([^)]+)\)", html)) <= set(ids)


def test_survives_lost_measurement_pixels_and_no_meshes(tmp_path: Path) -> None:
    study = make_study(tmp_path, "fit", "compare", "diagnose")
    (tmp_path / "recording.zarr").rename(tmp_path / "elsewhere.zarr")
    group = study.results("r+")
    for name in ROLES:
        for array in ("vertices", "triangles", "scatter"):
            del group[f"compare/{name}/{array}"]
        for array in ("vertices_before", "vertices_after"):
            del group[f"diagnose/{name}/{array}"]
    page = page_of(study)
    assert "hidden" not in page.sections
    assert page.figures["canvas"] == 1 and page.figures["img"] == 3 + 3 + 3


def test_points_without_correspondence_are_not_paired(tmp_path: Path) -> None:
    page = page_of(make_study(tmp_path, "fit", "compare", correspondence=False))
    assert "points" not in page.sections and page.figures["img"] == 3 + 3  # no map: its rows would mean nothing


def test_what_an_older_comparison_kept_is_enough(tmp_path: Path) -> None:
    study = make_study(tmp_path, "fit", "compare", hidden=False)
    group = study.results("r+")["compare"]
    for name in ROLES:
        del group[f"{name}/witness"]  # type: ignore[attr-defined]
    group.attrs.update(groups=[], signs=[])
    page = page_of(study)
    assert page.sections == ["object", "error", "recordings", "points", "fit", "provenance"]


def test_the_film_of_predictions_is_small_and_whole(tmp_path: Path) -> None:
    found = gather(make_study(tmp_path, "fit", "compare"))
    film = predictive_data(found)
    assert film is not None and film["draws"] == 8 and len(film["data"]) < 300_000
    data = json.loads(film["data"])
    frames, take = len(data["time"]), found.takes[0]
    assert frames >= 12 and data["paired"]
    assert take.measured is not None and take.compared is not None
    packed = np.frombuffer(base64.b64decode(data["best"]), "<i2").reshape(frames, -1, 3).astype(float)
    measured = np.frombuffer(base64.b64decode(data["measured"]), "<i2").reshape(frames, -1, 3)
    assert (measured == -32768).any() == bool(np.isnan(take.measured).any())
    shown = take.compared.predicted[np.searchsorted(take.time, np.array(data["time"]) - 1e-4)]
    scale = np.ptp(shown[..., 2]) / np.ptp(packed[..., 2])
    np.testing.assert_allclose(np.ptp(packed, axis=1) * scale, np.ptp(shown, axis=1), atol=1e-3)
    assert len(data["draws"]) == 8 and max(data["lines"]) < packed.shape[1]


def test_compare_writes_what_it_found_as_json(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Found:
        def text(self) -> str:
            return "in words"

        def to_json(self) -> dict[str, object]:
            return {"p_value": 0.2, "rows": [{"rmse": float("nan")}]}

    study, out = make_study(tmp_path), tmp_path / "found.json"
    monkeypatch.setattr(Study, "compare", lambda self: Found())
    steps.compare(study.path, json_file=out)
    assert json.loads(out.read_text()) == {"p_value": 0.2, "rows": [{"rmse": None}]}
    with pytest.raises(MissingFileError, match="no folder"):
        steps.compare(study.path, json_file=tmp_path / "no" / "found.json")


def test_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = make_study(tmp_path, "fit")
    path = write_report(study, tmp_path / "new" / "r.html")
    first = path.read_text(encoding="utf-8")

    def full(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(StoreError, match="disk is full"):
        write_report(study, path)
    assert path.read_text(encoding="utf-8") == first
    assert [p.name for p in path.parent.iterdir()] == ["r.html"]


def test_missing_matplotlib_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = make_study(tmp_path, "fit")
    for name in [n for n in sys.modules if n.startswith("muslin.cli.report.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "jinja2", None)
    with pytest.raises(MuslinError, match=r"pip install 'muslin\[report\]'"):
        write_report(study)


def test_overview_picture(tmp_path: Path) -> None:
    study = make_study(tmp_path, "fit", "compare", "diagnose")
    assert overview_figure(study).startswith(b"\x89PNG")
    (tmp_path / "b").mkdir()
    with pytest.raises(StepMissingError, match="muslin compare"):
        overview_figure(make_study(tmp_path / "b", "fit"))


def test_what_names_the_colours_of_the_overview_stands_above_the_curves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Figure] = []
    monkeypatch.setattr("muslin.cli.report.overview.png", lambda figure, dots: drawn.append(figure))
    overview_figure(make_study(tmp_path, "fit", "compare", "diagnose"))
    drawn[0].draw_without_rendering()
    axes = drawn[0].axes[0]
    key = [t for t in axes.texts if not t.get_text().startswith("worst")]
    assert {"fitted model", "grey: noise"} <= {t.get_text() for t in key}
    boxes = [t.get_window_extent() for t in key]
    assert all(box.y0 >= axes.bbox.y1 for box in boxes)
    assert all(a.x1 < b.x0 for a, b in pairwise(boxes))


@pytest.mark.parametrize("axes", [slice(0, 2), slice(0, 3)])
def test_points_that_are_seen_along_some_axes_only_are_drawn_and_told(tmp_path: Path, axes: slice) -> None:
    """Of falling balls the height alone, and here and there not even that."""
    study = make_study(tmp_path, "fit", "compare")
    with storage_errors(study.results_path):
        compared = study.results("r+")["compare"]
        for name in ROLES:
            for array in ("measured", "difference"):
                values = np.asarray(compared[f"{name}/{array}"])
                values[..., axes] = np.nan
                compared[f"{name}/{array}"][...] = values
    shown = snapshots(gather(study).takes[0], "")[0]
    assert np.isfinite(shown.errors()).any() == (axes.stop < 3)
    drawn = np.isfinite(shown.places())
    np.testing.assert_array_equal(drawn, np.isfinite(shown.measured).any(axis=1, keepdims=True) & np.ones(3, bool))
    np.testing.assert_array_equal(shown.places()[drawn[:, 0], axes], shown.predicted[drawn[:, 0], axes])
    assert overview_figure(study).startswith(b"\x89PNG")
    compared = gather(study).takes[0].compared
    assert compared is not None
    assert np.isfinite(distance(compared.difference)).any() == (axes.stop < 3)
    assert "error" in page_of(study).text


@pytest.mark.parametrize(
    ("mean", "sd", "unit", "text"),
    [
        (1.19, 0.09, "1", "1.19 ± 0.09"),
        (1.19, 0.11, "1", "1.19 ± 0.11"),
        (920.4, 180.0, "N/m", "920 ± 180 N/m"),
        (2.4e-5, 1.6e-5, "N m", "(2.4 ± 1.6) × 10⁻⁵ N m"),
        (-0.02, 0.003, "rad", "−0.020 ± 0.003 rad"),
        (3.0, 0.0, "s", "3 s"),
        (float("nan"), 1.0, "s", "–"),
    ],
)
def test_spread(mean: float, sd: float, unit: str, text: str) -> None:
    assert spread(mean, sd, unit).replace("\u00a0", " ") == text
