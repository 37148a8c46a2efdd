"""The benchmark on real recordings: which takes it uses, and what it writes."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import real
import real_measures
import zarr
from real import COLUMNS, TITLES, joined, markdown, rms
from real_cases import BEAM_TAKES, BEAMS, CASES, Case, on_pybullet
from real_measures import bootstrap, measures, to_surface, within

from muslin.core.body import cloth_grid
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.store import put


def test_the_table_has_a_column_a_title_and_says_what_is_missing() -> None:
    row = dict.fromkeys(COLUMNS, 0.0123) | {
        "set": "one",
        "fitted on": ["a", "b"],
        "held out": ["c"],
        "after": None,
        "verdict": "none: -",
        "rollouts": 7,
        "seconds": 3.2,
        "fitted open loop": {"median_point": 0.005, "mean_coordinate": 0.004},
        "posterior": {"drag": {"best": 1.5, "low": 1.0, "median": 1.4, "high": 2.0, "unit": "N"}},
        "coverage": 0.25,
        "largest": 0.02,
        "mean_point": 0.012,
        "mean_point_interval": [0.011, 0.013],
    }
    lines = markdown([row], {"two": "there is no two.npz"}).splitlines()
    assert lines[0].count("|") == lines[1].count("|") == lines[2].count("|") == len(TITLES) + 1
    assert "| 12.3 | 12.3 | 12.3 | – | 12.3 |" in lines[2]
    assert any("median point error 5.0 mm, mean absolute coordinate error 4.0 mm" in line for line in lines)
    assert "- one: best fit (90 % of the posterior): drag 1.5 N (1 to 2)" in lines
    assert (
        "- one, held out: mean point error 12.0 mm (11.0 to 13.0), 20.0 mm in the worst frame; 25 % of the coordinates "
        "within the posterior's 90 % intervals" in lines
    )
    assert lines[-1] == "- skipped: two: there is no two.npz"
    assert rms([3.0, 4.0]) == np.sqrt(12.5)


def test_what_is_in_the_repository_is_never_skipped() -> None:
    assert [c.name for c in CASES if c.name.startswith(("ball", "beam"))] == [
        c.name for c in CASES if c.needs.exists() and "examples" in c.needs.parts
    ]


def test_a_run_of_some_sets_leaves_the_others_as_they_were() -> None:
    labels = {"machine": "an old one", "versions": {"muslin": "0.0.1"}}
    old = {**labels, "rows": [{"set": "cable 1", "fitted": 1.0}, {"set": "beam", "machine": "another", "versions": {}}]}
    old["skipped"] = {"cable 2": "there is no cable2.npz", "cable 3": "there is no cable3.npz"}
    new = [{"set": name, "machine": "this one", "versions": {"muslin": "9"}} for name in ("cable 2", "ball: golf")]
    rows, skipped = joined(old, new, {"carried cloth": "there is none", "beam": "there is none"})
    assert [(r["set"], r["machine"]) for r in rows] == [
        ("ball: golf", "this one"),
        ("beam", "another"),
        ("cable 1", "an old one"),
        ("cable 2", "this one"),
    ]
    assert rows[2] == {"set": "cable 1", "fitted": 1.0, **labels}
    assert skipped == {"cable 3": "there is no cable3.npz", "carried cloth": "there is none"}
    assert joined({}, new, skipped)[0] == [new[1], new[0]]
    gone = {**labels, "rows": [{"set": "cable 1, guessed"}], "skipped": {"a sock": "there is none"}}
    assert joined(gone, [], {}) == ([], {})


def test_a_run_that_dies_keeps_the_rows_that_it_has(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def row_of(case: Case, _study: object) -> dict[str, Any]:
        if case.name == "ball: tennis":
            raise MemoryError
        one = dict.fromkeys(COLUMNS, 0.1) | {"set": case.name, "fitted on": ["a"], "held out": ["b"]}
        return one | {"verdict": "none: -", "rollouts": 1, "seconds": 2.0, "machine": "m"}

    monkeypatch.setattr(real, "RESULTS", tmp_path)
    monkeypatch.setattr(real, "row_of", row_of)
    monkeypatch.setattr("sys.argv", ["real.py", "--only", "ball: whiffle", "ball: tennis"])
    with pytest.raises(MemoryError):
        real.main()
    assert [r["set"] for r in json.loads((tmp_path / "real.json").read_text())["rows"]] == ["ball: whiffle"]
    assert "ball: whiffle" in (tmp_path / "real.md").read_text()


def test_a_set_that_is_not_there_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(real, "RESULTS", tmp_path)
    monkeypatch.setattr("sys.argv", ["real.py", "--only", "cable 9"])
    with pytest.raises(SystemExit):
        real.main()
    assert "'cable 9'" in capsys.readouterr().err and not list(tmp_path.iterdir())


def study_of(rmse: float, simulations: int) -> Any:
    noise = SimpleNamespace(sd=0.003, source="two repeats")
    return SimpleNamespace(
        fit=lambda: SimpleNamespace(noise=noise, simulations=simulations, values=lambda: {"stiffness": 3.0}),
        compare=lambda: SimpleNamespace(rows=[SimpleNamespace(role="held-out", baseline=0.3, default=0.2, rmse=rmse)]),
        config=SimpleNamespace(study=SimpleNamespace(fit_on=["a"])),
        problem=SimpleNamespace(
            fit_on=("a from 0 s", "a from 1 s"),
            hold_out=("b",),
            space=ParameterSpace([Parameter("stiffness", "N/m", 1.0, 5.0)]),
        ),
    )


def row_with(monkeypatch: pytest.MonkeyPatch, verdict: str, effects: list[str]) -> tuple[dict[str, Any], list[str]]:
    """The row of a study with this diagnosis, and the effects that were added for it."""
    study, better, added = study_of(0.1, 4), study_of(0.01, 6), []
    found = {
        "verdict": verdict,
        "effects": effects,
        "simulations": 5,
        "candidates": [],
        "told": {"where": "At the end."},
    }
    study.diagnose = lambda: SimpleNamespace(result=found)
    study.add = lambda effects: added.extend(effects) or better
    monkeypatch.setattr(real, "posterior", lambda s: {})
    monkeypatch.setattr(real, "measures", lambda s: {"coverage": 0.9 if s is better else 0.1})
    return real.row_of(Case("ball: golf", Path(), lambda folder, workers: study), study), added


def test_a_row_holds_what_was_told_and_where_it_was_made(monkeypatch: pytest.MonkeyPatch) -> None:
    row, added = row_with(monkeypatch, "none", [])
    assert row["told"] == {"where": "At the end."} and row["rollouts"] == 9
    assert row["machine"] == real.machine() and row["versions"] == real.versions() and row["commit"]
    assert row["after"] is None and "coverage after" not in row and not added
    json.dumps(row)


@pytest.mark.parametrize(
    ("verdict", "effects", "expected"),
    [("named", ["air-drag", "hem"], ["air-drag", "hem"]), ("tied", ["air-drag", "hem"], ["air-drag"])],
)
def test_what_was_named_is_fitted_anew_and_of_a_tie_the_first(
    monkeypatch: pytest.MonkeyPatch, verdict: str, effects: list[str], expected: list[str]
) -> None:
    row, added = row_with(monkeypatch, verdict, effects)
    assert added == expected
    assert row["fitted"] == 0.1 and row["after"] == 0.01 and row["rollouts"] == 15
    assert row["coverage"] == 0.1 and row["coverage after"] == 0.9


# --- measures ------------------------------------------------------------------------------------------------------


def test_the_bootstrap_interval_of_takes_alike_is_narrow_and_of_takes_apart_wide() -> None:
    rng, times = np.random.default_rng(1), [0.1 * np.arange(60)] * 4
    alike = [rng.normal(10.0, 1.0, (60, 7)) for _ in times]
    low, high = bootstrap(alike, times)
    assert low < 10.1 and high > 9.9 and high - low < 0.5
    apart = [a + 8.0 * k for k, a in enumerate(alike)]
    assert bootstrap(apart, times)[1] - bootstrap(apart, times)[0] > 10.0


def test_points_that_were_not_seen_have_no_share_in_the_bootstrap() -> None:
    distance = np.ones((30, 4))
    distance[:, 1] = np.nan
    distance[10:20] = np.nan
    assert bootstrap([distance], [0.1 * np.arange(30)]) == [1.0, 1.0]


def test_points_that_have_slid_along_a_sheet_are_on_it() -> None:
    sheet = np.stack(np.meshgrid(np.linspace(0, 1, 11), np.linspace(0, 1, 11), [0.0]), axis=-1).reshape(-1, 3)
    measured = np.array([[[0.3, 0.5, 0.02], [np.nan] * 3], [[0.6, 0.5, 0.0], [0.2, 1.0, 0.03]]])
    assert np.allclose(to_surface(measured, [sheet, sheet]), [0.02, 0.0, 0.03])


@pytest.mark.parametrize("paired", [True, False])
def test_intervals_hold_nine_of_ten_of_what_the_model_and_the_noise_make(paired: bool) -> None:
    rng, sd, scatter = np.random.default_rng(2), 0.002, 0.003
    shape = (200, 12, 3)
    difference = rng.normal(0.0, np.hypot(sd, scatter), shape if paired else (200, 40, 3))
    difference[3, 2] = np.nan
    inside = within(difference, rng.normal(0.0, scatter, (40, *shape)), sd)
    assert len(inside) == difference.size - 3 and 0.88 < inside.mean() < 0.92


def test_what_a_compared_study_is_off_is_measured_on_held_out_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    body = cloth_grid(0.3, 0.3, 4, 4)
    place = np.repeat(body.vertices[None], 5, axis=0)
    off = np.zeros(place.shape)
    off[3, :, 1] = 0.01  # off the sheet in one frame of five
    off[4, 5, 0] = 0.05  # along it, of one point
    off[0, :, 0] = np.nan  # not seen in one direction
    scenario = SimpleNamespace(body=body, unit="m", sampled=False, markers=np.eye(16))
    group = zarr.group(zarr.storage.MemoryStore())
    take = group.create_group("b")
    for name, values in {"difference": off, "predicted": place, "vertices": place}.items():
        put(take, name, values, ["time", "point", "axis"], "m")
    put(take, "draws", np.repeat(place[None], 3, axis=0), ["draw", "time", "point", "axis"], "m")
    put(take, "time", np.arange(5.0), ["time"], "s")
    study: Any = SimpleNamespace(
        step_results=lambda step: group, problem=SimpleNamespace(hold_out=("b",), scenarios={"b": scenario})
    )
    monkeypatch.setattr(real_measures, "load_fit", lambda s: SimpleNamespace(noise=SimpleNamespace(sd=0.001)))
    found = measures(study)
    assert np.isclose(found["largest"], 0.01) and np.isclose(found["mean_point"], (0.01 + 0.05 / 16) / 5)
    assert np.isclose(found["mean_surface"], 0.01 / 4, rtol=0.02)
    assert np.isclose(found["coverage"], 1 - (16 + 1) / (5 * 16 * 3 - 16))


def test_a_set_can_be_tried_on_the_other_engine(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "other").mkdir()
    mine, other = BEAMS[0].make(tmp_path / "mine", 1), on_pybullet(BEAMS[0]).make(tmp_path / "other", 1)
    assert (mine.config.simulator.name, other.config.simulator.name) == ("mujoco", "pybullet")
    assert mine.problem.fit_on == other.problem.fit_on == ("gravity-b",)
    assert set(other.problem.hold_out) == set(BEAM_TAKES[1:])
