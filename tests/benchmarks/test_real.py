"""The benchmark on real recordings: which takes it uses, and what it writes."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import real
from real import COLUMNS, TITLES, joined, markdown, rms
from real_cases import CASES, Case, spread, start_speed

from muslin.core.measurement import Recording
from muslin.core.series import PointSeries


def moving(speed: float, hidden: bool = False) -> Recording:
    time = 0.01 * np.arange(50)
    points = np.zeros((50, 3, 3))
    points[:, 1, 0] = speed * time
    if hidden:
        points[2, 0] = np.nan
    return Recording("take", PointSeries(time, points))


def test_the_speed_at_the_start_is_that_of_the_fastest_marker() -> None:
    assert np.isclose(start_speed(moving(0.7)), 0.7)
    assert start_speed(moving(0.0)) == 0.0
    assert start_speed(moving(0.7, hidden=True)) == np.inf


def test_takes_that_are_spread_are_the_middles_of_even_parts() -> None:
    takes = [moving(0.1 * k) for k in range(15)]
    assert spread(takes, 5) == [takes[k] for k in (1, 4, 7, 10, 13)]
    assert spread(takes, 15) == takes


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
    }
    lines = markdown([row], {"two": "there is no two.npz"}).splitlines()
    assert lines[0].count("|") == lines[1].count("|") == lines[2].count("|") == len(TITLES) + 1
    assert "| 12.3 | 12.3 | 12.3 | – | 12.3 |" in lines[2]
    assert any("median point error 5.0 mm, mean absolute coordinate error 4.0 mm" in line for line in lines)
    assert lines[-1] == "- skipped: two: there is no two.npz"
    assert rms([3.0, 4.0]) == np.sqrt(12.5)


def test_what_is_in_the_repository_is_never_skipped() -> None:
    assert [c.name for c in CASES if c.name.startswith("ball") or c.name == "beam"] == [
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


def test_a_row_holds_what_was_told_and_where_it_was_made() -> None:
    told = {"verdict": "Drag is missing.", "where": "At the end."}
    error = {"before": 0.02, "after": 0.01}
    found = {
        "verdict": "named",
        "effects": ["air-drag"],
        "error": error,
        "simulations": 5,
        "candidates": [],
        "told": told,
    }
    noise = SimpleNamespace(sd=0.003, source="two repeats")
    study = SimpleNamespace(
        fit=lambda: SimpleNamespace(noise=noise, simulations=4, values=lambda: {"stiffness": 3.0}),
        compare=lambda: SimpleNamespace(rows=[SimpleNamespace(role="held-out", baseline=0.3, default=0.2, rmse=0.1)]),
        diagnose=lambda: SimpleNamespace(result=found),
        problem=SimpleNamespace(fit_on=("a",), hold_out=("b",)),
    )
    row = real.row_of(Case("ball: golf", Path(), lambda folder, workers: study), study)
    assert row["told"] == told and row["rollouts"] == 9
    assert row["machine"] == real.machine() and row["versions"] == real.versions()
    json.dumps(row)
