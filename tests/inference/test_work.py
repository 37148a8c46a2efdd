"""What a diagnosis tells of errors is of fits as a user makes them."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from test_verdict import candidate

from muslin.core.arrays import FloatArray
from muslin.core.measurement import Recording
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.rollout import Trajectory
from muslin.core.series import PointSeries
from muslin.inference.criticism.candidate import Candidate
from muslin.inference.criticism.work import Work
from muslin.inference.discrepancy import Discrepancy
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective, polish
from muslin.inference.residuals import Offsets

TIME = np.linspace(0.0, 1.0, 20)
WAVE = np.stack([np.sin(7 * TIME), TIME], axis=1)[:, :, None] * (0.05, 0.0, 0.02)  # (T, 2, 3)
#: What no height of the wave explains.
OTHER = np.roll(WAVE, 1, axis=1) * (1, 0, -1)
BEST = 0.3
NOISE = Noise(0.001, 0.0, "test", "m", 0.01)
SPACE = ParameterSpace((Parameter("a", "1", 0.0, 1.0),))


class Pool:
    """Simulates a wave as high as its parameter."""

    def __init__(self, seen: PointSeries | None = None, wave: FloatArray = WAVE) -> None:
        self.seen, self.wave = seen or PointSeries(TIME, BEST * WAVE + 0.2 * OTHER), wave
        self.problem = SimpleNamespace(recordings={"r": Recording("r", self.seen)})

    def map(self, tasks: list[SimpleNamespace]) -> list[Trajectory]:
        made = [PointSeries(self.seen.time, sum(task.values.values()) * self.wave) for task in tasks]
        return [Trajectory(series, series.points, np.zeros((len(series.time), 1, 7))) for series in made]


def test_the_told_fit_is_not_left_where_numerics_may_explain_it() -> None:
    """A finer mesh would change the wave and the other together, so beside it the wave is fitted too low."""
    pool = Pool()
    numerics = Discrepancy({"r": 10.0 * (WAVE + OTHER).reshape(-1, 1) / NOISE.sd})
    work = SimpleNamespace(
        pool=pool, problem=SimpleNamespace(fit_on=("r",), pieces=1), fit=SimpleNamespace(noise=NOISE),
        offsets=Offsets(), discrepancy=numerics, _as_fitted={},
    )  # fmt: skip
    beside = polish(Objective(pool, SPACE, ("r",), NOISE, Offsets(), discrepancy=numerics), np.array([0.8]), 8)  # type: ignore[arg-type]
    assert abs(beside.unit[0] - BEST) > 0.1
    plain = polish(Objective(pool, SPACE, ("r",), NOISE, Offsets()), np.array([0.8]), 8)  # type: ignore[arg-type]
    found = candidate("drag", 1.0)
    found.__dict__.update(space=SPACE, fit=beside)
    np.testing.assert_allclose(Work.as_a_user_fits(work, found), [plain.unit[0]], atol=1e-3)  # type: ignore[arg-type]
    work.discrepancy = Discrepancy()
    np.testing.assert_array_equal(Work.as_a_user_fits(work, found), beside.unit)  # type: ignore[arg-type]


@pytest.mark.parametrize("misfit", [0.0, 0.2])
def test_a_misfit_that_numerics_do_not_explain_casts_doubt_on_what_they_take_off(misfit: float) -> None:
    """Doubt goes as far as the fit goes without them, where what is left is no noise."""
    aside = np.array([0.0, 0.05, 0.0])  # what nothing explains
    noise = 0.001 * np.random.default_rng(0).normal(size=WAVE.shape)
    pool = Pool(PointSeries(TIME, BEST * WAVE + misfit * (OTHER + aside) + noise))
    space = ParameterSpace((Parameter("drag.a", "1", 0.0, 1.0),))
    numerics = Discrepancy({"r": 10.0 * (WAVE + OTHER).reshape(-1, 1) / NOISE.sd})
    work = SimpleNamespace(
        pool=pool, problem=SimpleNamespace(fit_on=("r",), pieces=1), fit=SimpleNamespace(noise=NOISE),
        offsets=Offsets(), discrepancy=numerics, _as_fitted={}, _effects_of=lambda candidate: (),
        objective=lambda effects: Objective(pool, space, ("r",), NOISE, Offsets(), discrepancy=numerics),  # type: ignore[arg-type]
    )  # fmt: skip
    work._again, work.as_a_user_fits = partial(Work._again, work), partial(Work.as_a_user_fits, work)
    found = candidate("drag", 1.0)
    found.__dict__.update(space=space, base=0, fit=polish(work.objective(()), np.array([0.8]), 8))
    mean, sd, _ = Work.told(work, found).coefficients["a"]  # type: ignore[arg-type]
    if misfit:
        assert found.fit.left > 20.0 and abs(mean - BEST) > 0.1
        plain = polish(Objective(pool, space, ("r",), NOISE, Offsets()), np.array([0.8]), 8)  # type: ignore[arg-type]
        assert sd == pytest.approx(abs(mean - plain.unit[0]), rel=0.05)
    else:
        assert sd == found.coefficients["a"][1] and abs(mean - BEST) < 3 * sd


@pytest.mark.parametrize("lasts", [False, True])
def test_a_misfit_that_lasts_makes_coefficients_less_certain(lasts: bool) -> None:
    """Of misfits of one size, shorter than the recording, errors are as large as they are told to be, in the mean."""
    space, time = ParameterSpace((Parameter("drag.a", "1", 0.0, 1.0),)), np.linspace(0.0, 30.0, 600)
    wave = np.stack([np.sin(3 * time), np.cos(2 * time)], axis=1)[:, :, None] * (0.05, 0.0, 0.02)  # (T, 2, 3)
    errors, by_size = [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        phase, frequency = rng.uniform(0, 2 * np.pi, wave.shape[1:]), rng.uniform(2, 5, wave.shape[1:])
        slow = 2**0.5 * np.sin(frequency * time[:, None, None] + phase)
        off = 0.01 * (slow if lasts else rng.normal(size=wave.shape)) + 0.001 * rng.normal(size=wave.shape)
        objective = Objective(Pool(PointSeries(time, BEST * wave + off), wave), space, ("r",), NOISE, Offsets())  # type: ignore[arg-type]
        work = SimpleNamespace(discrepancy=Discrepancy(), _effects_of=lambda c: (), objective=lambda e, o=objective: o)
        work._again, work.as_a_user_fits = partial(Work._again, work), partial(Work.as_a_user_fits, work)
        found = candidate("drag", 1.0)
        found.__dict__.update(space=space, base=0, fit=polish(objective, np.array([0.8]), 8))
        assert found.fit.left > 10.0
        mean, sd, _ = Work.told(work, found).coefficients["a"]  # type: ignore[arg-type]
        errors.append((mean - BEST) ** 2 / sd**2)
        by_size.append((mean - BEST) ** 2 / found.coefficients["a"][1] ** 2)
    assert 0.3 < np.mean(errors) < 2.0
    assert (np.mean(by_size) > 4.0) == lasts


@pytest.mark.parametrize("ar1", [0.0, 0.5])
def test_evidence_says_whether_held_out_motions_would_show_a_candidate(ar1: float) -> None:
    pool, noise = Pool(), replace(NOISE, ar1=ar1)
    work = SimpleNamespace(
        pool=pool, problem=SimpleNamespace(fit_on=("r",), hold_out=("r",), recordings=pool.problem.recordings),
        fit=SimpleNamespace(noise=noise), offsets=Offsets(), discrepancy=Discrepancy(), _held_out={},
        space=lambda effects: SPACE, objective=lambda effects: Objective(pool, SPACE, ("r",), noise, Offsets()),
    )  # fmt: skip
    work.held_out, work.judged = partial(Work.held_out, work), partial(Work.judged, work)
    plain = polish(work.objective(()), np.array([0.8]), 8)
    moved = [0.001, 0.3]  # of the wave's height
    candidates = [Candidate("drag", SPACE, 0, replace(plain, unit=plain.unit + m)) for m in moved]
    found = Work.evidence(work, (), plain, candidates).candidates  # type: ignore[arg-type]
    worth = (1 - ar1) / (1 + ar1)  # of a number of an AR(1) sequence, for its mean
    expected = [worth * float(np.sum((m * WAVE) ** 2)) / noise.sd**2 for m in moved]
    np.testing.assert_allclose([c.held_out_shift for c in found], expected, rtol=1e-6)
    assert [c.shown_held_out for c in found] == [False, True]
    squares = [np.sum(((BEST - plain.unit[0] - m) * WAVE + 0.2 * OTHER) ** 2) for m in (0.0, *moved)]
    gains = [worth * (squares[0] - after) / noise.sd**2 for after in squares[1:]]
    np.testing.assert_allclose([c.held_out_gain for c in found], gains, rtol=1e-6)


@pytest.mark.parametrize("offsets", [Offsets(), Offsets(clock=0.01, constant=0.01)])
def test_the_residuals_of_some_recordings_are_found_among_those_of_all(offsets: Offsets) -> None:
    pool, names = Pool(), ("r", "late", "long")
    hidden = BEST * WAVE + 0.01
    hidden[3:7, 1] = np.nan
    late, long = PointSeries(TIME, hidden), PointSeries(TIME, BEST * WAVE - 0.02)
    pool.problem.recordings |= {"late": Recording("late", late), "long": Recording("long", long)}
    every, unit = Objective(pool, SPACE, names, NOISE, offsets), np.array([0.8])  # type: ignore[arg-type]
    for some in (["late"], ["r", "long"], list(names)):
        few = Objective(pool, SPACE, some, NOISE, offsets)  # type: ignore[arg-type]
        np.testing.assert_array_equal(every.one(unit)[every.rows(some)], few.one(unit))
    assert not every.rows([]).any()
    found = every.part(polish(every, unit, 4), few := every.on(["late"]))
    again = polish(few, found.unit, 1)
    np.testing.assert_array_equal(found.white, few.one(found.unit))
    assert found.count == again.count == len(found.white)
