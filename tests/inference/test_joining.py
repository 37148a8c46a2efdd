"""Pieces of a recording are told of as the recording."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from linear_study import SD, TIME, fitted, measured
from next_world import cut_in_half, register, rope_study

from muslin.core.rollout import Trajectory
from muslin.core.series import PointSeries
from muslin.inference.criticism.comparing.groups import partitions
from muslin.inference.criticism.comparing.held import Held
from muslin.inference.criticism.comparing.joining import rejoined
from muslin.inference.criticism.comparing.result import pieces_sentence
from muslin.inference.noise import Noise
from muslin.inference.residuals import Offsets

NOISE = Noise(SD, 0.0, "told", "m", 0.02)


def whole() -> Held:
    rng = np.random.default_rng(0)
    points = measured(rng)
    points[3, 2] = np.nan
    (take,), _, _ = fitted(points, NOISE, Offsets(), np.full(3, 0.5))
    draws = take.best.series.points + 0.01 * rng.normal(size=(3, *points.shape))
    return replace(take, draws=draws, baseline=points + 1.0, unfitted=points + 2.0)


def cut(take: Held, name: str, part: slice) -> Held:
    def of(series: PointSeries) -> PointSeries:
        return replace(series, time=series.time[part], points=series.points[part])

    def of_part(whole: Trajectory) -> Trajectory:
        return replace(whole, series=of(whole.series), vertices=whole.vertices[part], poses=whole.poses[part])

    seen, off = take.recording, take.residual.difference[part]
    return replace(
        take,
        recording=replace(seen, name=name, series=of(seen.series)),
        scenario=replace(take.scenario, times=take.scenario.times[part]),
        best=of_part(take.best),
        shown=of_part(take.shown),
        residual=replace(take.residual, difference=off, white=off[np.isfinite(off)] / SD),
        draws=take.draws[:, part],
        baseline=take.baseline[part],
        unfitted=take.unfitted[part],
    )


def test_pieces_put_together_are_what_was_cut() -> None:
    take, half = whole(), len(TIME) // 2
    other = replace(take, recording=replace(take.recording, name="other"), fitted=False)
    pieces = [cut(take, "swing from 0 s", slice(0, half)), cut(take, "swing from 1 s", slice(half, None)), other]
    joined, same = rejoined(pieces, {"swing from 0 s": "swing", "swing from 1 s": "swing"})
    assert (joined.name, same is other) == ("swing", True)
    for made, expected in (
        (joined.recording.series.points, take.recording.series.points),
        (joined.recording.series.time, take.recording.series.time),
        (joined.best.vertices, take.best.vertices),
        (joined.shown.vertices, take.shown.vertices),
        (joined.draws, take.draws),
        (joined.baseline, take.baseline),
        (joined.unfitted, take.unfitted),
        (joined.scenario.times, take.scenario.times),
    ):
        np.testing.assert_array_equal(made, expected)
    assert joined.residual.rms == take.residual.rms and len(joined.residual.white) == joined.seen.sum()
    assert partitions([joined, same])[0].names == ("swing", "other")


def test_what_was_not_cut_stays_as_it_is() -> None:
    take = whole()
    assert rejoined([take], {})[0] is take
    assert pieces_sentence(1.0) == "" and "5 of each" in pieces_sentence(5.0)


def test_a_comparison_tells_of_the_recording_and_keeps_it_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    register(monkeypatch)
    study = rope_study(tmp_path)
    frames = len(study.problem.recordings["slow"].series.time)
    cut_in_half(study)
    found = study.compare()
    assert [r.recording for r in found.rows] == ["slow"] and "(2 of each, in the mean)" in found.text()
    kept = study.results()["compare"]
    assert list(kept) == ["slow"] and kept["slow"]["error"].shape == (frames,)
