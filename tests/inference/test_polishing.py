"""The best fit of a study with many recordings: searched on some of them, and kept if it is better on all."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from small import TRUTH, small_measurement, write_study
from valleys import NAMES, SEEN, Valleys

from muslin.core.arrays import FloatArray
from muslin.core.measurement import Measurement
from muslin.core.study import Study
from muslin.inference.criticism.work import Work
from muslin.inference.discrepancy import Discrepancy
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective, Polished, polish
from muslin.inference.residuals import Offsets
from muslin.inference.sequential import polishing
from muslin.inference.sequential.polishing import Polishing
from muslin.inference.subset import some_of


@pytest.mark.parametrize(("elsewhere", "kept"), [(1.0, True), (9.0, False)])
def test_a_better_place_is_searched_on_some_recordings_and_kept_if_it_is_better_on_all(
    elsewhere: float, kept: bool
) -> None:
    objective = Valleys(elsewhere, NAMES)
    best = polish(objective, np.array([0.25]))
    assert best.unit[0] == pytest.approx(0.2, abs=0.01)
    rested: list[Polished] = []
    polishing = SimpleNamespace(
        objective=objective, best=best, simulations=0, _pool=SimpleNamespace(count=0),
        _study=SimpleNamespace(progress=lambda *_: None), _rest=lambda _, found: rested.append(found),
    )  # fmt: skip
    objective.evaluations = 0
    Polishing.look_from(polishing, np.array([[0.3], [0.75], [0.9]]))  # type: ignore[arg-type]
    assert [round(float(found.unit[0]), 2) for found in rested] == ([0.8] if kept else [])
    assert all(len(found.white) == SEEN * len(NAMES) for found in rested)
    assert objective.evaluations < 20  # the end of one search; all else on some


def test_a_fit_of_many_takes_is_searched_on_some_and_ends_on_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    takes = [
        replace(r, name=f"{r.name} {k}")
        for k in range(10)
        for r in small_measurement(seed=k).recordings
        if r.name != "other"
    ]
    other = small_measurement().recordings[-1]
    study = Study.load(write_study(tmp_path, Measurement((*takes, other))), workers=0)
    real, searched = polishing.polish_from, []

    def noted(objective: Objective, starts: FloatArray, best: Polished | None = None) -> Polished:
        searched.append(objective.recordings)
        return real(objective, starts, best)

    monkeypatch.setattr(polishing, "polish_from", noted)
    fit = study.fit()
    assert searched and all(names == some_of([r.name for r in takes]) for names in searched)
    truth = np.array([TRUTH.stretch_stiffness, TRUTH.bending_rigidity])
    assert np.all(np.abs(fit.estimate - truth) < 4 * fit.sd), (fit.estimate, fit.sd)
    on_two = Study.load(write_study(tmp_path / "two", Measurement((*takes[:2], other))), workers=0).fit()
    assert np.all(fit.sd < 0.5 * on_two.sd)  # ten times as much tells it


@pytest.mark.parametrize("cut", [False, True])
def test_pieces_of_a_take_are_smooth_and_whole_takes_may_not_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cut: bool
) -> None:
    pytest.importorskip("mujoco")
    study = Study.load(write_study(tmp_path, small_measurement()), workers=0)
    if cut:
        cut_from = dict.fromkeys([*study.problem.fit_on, "more"], "whole")
        study.__dict__["problem"] = replace(study.problem, cut_from=cut_from)
    told: list[bool] = []

    class Noted(Exception):
        pass

    def noted(objective: Objective, starts: FloatArray, best: Polished | None = None) -> Polished:
        told.append(objective.smooth)
        raise Noted

    monkeypatch.setattr(polishing, "polish_from", noted)
    with pytest.raises(Noted):
        study.fit()
    work = SimpleNamespace(
        pool=None, problem=study.problem, space=lambda effects: study.problem.space, offsets=Offsets(),
        fit=SimpleNamespace(noise=Noise(1.0, 0.0, "test", "m", 0.01)), discrepancy=Discrepancy(),
    )  # fmt: skip
    told += [Work.objective(work, ()).smooth, Work.objective(work, (), ["a"]).on(["b"]).smooth]  # type: ignore[arg-type]
    assert told == [cut] * 3
