"""Which of many takes a new study fits, and which it holds out."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.core.measurement import Recording
from muslin.core.series import PointSeries
from muslin.core.study.choice import chosen, spread, start_speed

TIME = 0.01 * np.arange(50)


def moving(speed: float, hidden: bool = False, name: str = "take", motion: str = "") -> Recording:
    points = np.zeros((50, 3, 3))
    points[:, 1, 0] = speed * TIME
    if hidden:
        points[2, 0] = np.nan
    return Recording(name, PointSeries(TIME, points), motion=motion)


def test_the_speed_at_the_start_is_that_of_the_fastest_marker() -> None:
    assert start_speed(moving(0.7)) == pytest.approx(0.7)
    assert start_speed(moving(0.0)) == 0.0
    assert start_speed(moving(0.7, hidden=True)) == np.inf


@pytest.mark.parametrize("unit, correspondence", [("m", False), ("px", True), ("px", False)])
def test_points_that_are_nobodys_or_found_in_pictures_are_as_fast_as_their_middle(
    unit: str, correspondence: bool
) -> None:
    rng = np.random.default_rng(0)
    axes = 3 if unit == "m" else 2
    points = np.tile(rng.normal(size=(1, 40, axes)), (50, 1, 1))
    points[..., 0] += 0.3 * TIME[:, None]
    if not correspondence:
        points = np.stack([rng.permutation(frame) for frame in points])
    series = PointSeries(TIME, points, unit, correspondence)  # type: ignore[arg-type]
    assert start_speed(Recording("take", series)) == pytest.approx(0.3)
    points[3] = np.nan
    assert start_speed(Recording("take", replace(series, points=points))) == np.inf


def test_what_is_spread_are_the_middles_of_even_parts() -> None:
    takes = [moving(0.1 * k) for k in range(15)]
    assert spread(takes, 5) == [takes[k] for k in (1, 4, 7, 10, 13)]
    assert spread(takes, 15) == spread(takes, 20) == takes


@pytest.mark.parametrize("count, held_out", [(1, []), (2, []), (3, [1]), (5, [1]), (6, [1, 4]), (9, [1, 4, 7])])
def test_of_few_takes_the_middle_one_of_every_three_is_held_out(count: int, held_out: list[int]) -> None:
    speeds = np.random.default_rng(count).permutation(count)
    fitted, held = chosen([moving(0.1 * v, name=str(v)) for v in speeds])
    assert held == [str(k) for k in held_out]
    assert fitted == [str(v) for v in speeds if v not in held_out]


def test_of_few_motions_all_are_fitted() -> None:
    takes = [moving(0.1 * k, name=f"take {k}", motion=f"motion {k % 2}") for k in range(8)]
    fitted, held_out = chosen(takes)
    assert sorted(fitted) == [t.name for t in takes] and held_out == []


def test_of_many_takes_some_are_fitted_and_held_out_by_turns_from_slow_to_fast() -> None:
    speeds = np.random.default_rng(1).permutation(27)
    fitted, held_out = chosen([moving(0.1 * v, name=str(v)) for v in speeds])
    assert fitted == ["1", "7", "13", "19", "25"]
    assert held_out == ["4", "10", "16", "22"]


def test_takes_of_a_motion_stay_together() -> None:
    takes = [moving(0.1 * m + 0.01 * k, name=f"{m}{'abc'[k]}", motion=f"m{m}") for k in range(3) for m in range(12)]
    fitted, held_out = chosen(takes)
    motions = [sorted({int(n[:-1]) for n in part}) for part in (fitted, held_out)]
    assert motions == [[0, 3, 6, 8, 11], [2, 4, 7, 10]]
    assert fitted[:3] == ["0a", "0b", "0c"] and (len(fitted), len(held_out)) == (15, 12)
    fitted, held_out = chosen([replace(t, motion=f"m{int(t.name[:-1]) % 3}") for t in takes])
    assert (len(fitted), len(held_out)) == (24, 12)  # three motions, of which one is held out
    fitted, held_out = chosen([replace(t, motion=f"m{int(t.name[:-1]) % 2}") for t in takes])
    assert (len(fitted), len(held_out)) == (36, 0)  # of two neither lies between the others
    assert chosen([replace(t, motion="one") for t in takes]) == ([t.name for t in takes], [])


def test_takes_that_are_not_seen_at_the_start_are_left_out_where_others_are_enough() -> None:
    hidden = [moving(0.0, hidden=True, name=f"hidden {k}") for k in range(6)]
    seen = [moving(0.1 * k, name=f"seen {k}") for k in range(9)]
    fitted, held_out = chosen([*hidden, *seen])
    assert fitted == [f"seen {k}" for k in (0, 2, 4, 6, 8)] and held_out == [f"seen {k}" for k in (1, 3, 5, 7)]
    fitted, held_out = chosen([*hidden, *seen[:5]])
    assert fitted[:2] == ["seen 0", "seen 3"] and (len(fitted), len(held_out)) == (5, 4)
    assert fitted[-1].startswith("hidden")
