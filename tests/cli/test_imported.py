"""What an import says: a line a recording, few lines of many, and no warning left out."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.cli.imported import ALL, FIRST, say_recordings
from muslin.core.measurement import Recording
from muslin.core.motion import Motion
from muslin.core.series import PointSeries

TIME = np.linspace(0.0, 1.0, 11)


def takes(count: int) -> list[Recording]:
    points = np.random.default_rng(0).normal(size=(len(TIME), 4, 3))
    return [Recording(f"take {k}", PointSeries(TIME, points)) for k in range(count)]


def test_few_recordings_have_a_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    say_recordings(takes(ALL))
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0].strip() for line in lines] == [f"take {k}" for k in range(ALL)]
    assert "11 frames from 0 to 1 s, 4 points, 100.0% seen" in lines[-1]


def test_many_are_told_together(capsys: pytest.CaptureFixture[str]) -> None:
    many = takes(30)
    hidden = many[20].series.points.copy()
    hidden[3:, 2] = np.nan
    many[20] = replace(many[20], series=PointSeries(TIME, hidden))
    many[29] = replace(many[29], series=PointSeries(TIME[:9], many[29].series.points[:9]))
    say_recordings(many)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == FIRST + 1
    said = "and 27 more, to take 29: 9 to 11 frames, 4 points, at least 81.8% seen (in take 20)"
    assert lines[-1].strip() == said


def test_one_of_many_with_a_warning_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    many = takes(30)
    moving = np.stack([TIME, 0.0 * TIME, 0.0 * TIME], axis=1)[:, None]
    many[17] = replace(many[17], gripper=Motion.from_positions(0.5 + 0.5 * TIME, moving))
    say_recordings(many)
    lines = capsys.readouterr().out.splitlines()
    assert lines[FIRST].strip().startswith("take 17: ")
    assert lines[FIRST + 1].strip().startswith("warning: ")
    assert lines[-1].strip().startswith("and 26 more, to take 29: 11 frames, 4 points, all seen")
