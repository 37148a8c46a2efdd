"""The benchmark on real recordings: which takes it uses, and what it writes."""

import numpy as np
from real import COLUMNS, TITLES, markdown, rms
from real_cases import CASES, start_speed

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
    lines = markdown([row], ["two: there is no two.npz"]).splitlines()
    assert lines[0].count("|") == lines[1].count("|") == lines[2].count("|") == len(TITLES) + 1
    assert "| 12.3 | 12.3 | 12.3 | – | 12.3 |" in lines[2]
    assert any("median point error 5.0 mm, mean absolute coordinate error 4.0 mm" in line for line in lines)
    assert lines[-1] == "- skipped: two: there is no two.npz"
    assert rms([3.0, 4.0]) == np.sqrt(12.5)


def test_what_is_in_the_repository_is_never_skipped() -> None:
    assert [c.name for c in CASES if c.name.startswith("ball") or c.name == "beam"] == [
        c.name for c in CASES if c.needs.exists() and "examples" in c.needs.parts
    ]
