"""The best fit of a study with many recordings: searched on some of them, and kept if it is better on all."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from small import TRUTH, small_measurement, write_study

from muslin.core.arrays import FloatArray
from muslin.core.measurement import Measurement
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.study import Study
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective, Polished, polish, some_of
from muslin.inference.residuals import Offsets
from muslin.inference.sequential import polishing
from muslin.inference.sequential.polishing import Polishing, _on_all

NAMES = [str(k) for k in range(20)]
SEARCHED = some_of(NAMES)
SHARP = 100.0
#: Numbers that a recording shows.
SEEN = 5


class Valleys(Objective):
    """Two valleys: every recording leaves what noise does at 0.8, and at 0.2 a misfit, which ``elsewhere`` may lessen.

    Args:
        elsewhere: what is left at 0.2 of recordings that are not searched on [noise standard deviations].
        recordings: names.
    """

    def __init__(self, elsewhere: float, recordings: list[str]) -> None:
        space = ParameterSpace((Parameter("a", "1", 0, 1),))
        noise = Noise(1.0, 0.0, "test", "m", 0.01)
        super().__init__(None, space, recordings, noise, Offsets())  # type: ignore[arg-type]
        self.elsewhere, self.evaluations = elsewhere, 0

    def on(self, recordings: list[str]) -> "Valleys":  # type: ignore[override]
        return Valleys(self.elsewhere, recordings)

    def rows(self, recordings: list[str]) -> FloatArray:  # type: ignore[override]
        return np.repeat([name in recordings for name in self.recordings], SEEN)

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        self.evaluations += len(units)
        return [np.concatenate([self.left(name, u[0]) for name in self.recordings]) for u in units]

    def left(self, name: str, unit: float) -> FloatArray:
        near, least = (0.8, 1.0 if name in SEARCHED else self.elsewhere) if unit > 0.5 else (0.2, 2.0)
        return np.full(SEEN, np.hypot(least, SHARP * (unit - near)))


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


def test_what_is_worse_on_all_recordings_than_where_the_search_began_is_left() -> None:
    objective = Valleys(9.0, NAMES)
    some = objective.on(SEARCHED)
    better = polish(some, np.array([0.75]))
    assert better.unit[0] == pytest.approx(0.8, abs=0.01)
    found = _on_all(objective, some, better, np.array([0.22]))
    assert found.unit[0] == pytest.approx(0.2, abs=0.01) and len(found.white) == SEEN * len(NAMES)


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
