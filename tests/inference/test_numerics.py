"""Better numbers explain a misfit only if the model comes nearer to the measurement with them."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from muslin.core.measurement import Recording
from muslin.core.series import PointSeries
from muslin.inference.criticism import numerics as module
from muslin.inference.criticism.numerics import numerics
from muslin.inference.noise import Noise
from muslin.inference.residuals import Offsets

TIME = np.linspace(0.0, 1.0, 20)
BASE = np.stack([np.sin(7 * TIME), TIME], axis=1)[:, :, None] * (0.05, 0.0, 0.02)  # (T, 2, 3)
#: What the smaller step changes, and across it what the other engine does.
STEP, ENGINE = (
    0.02 * np.roll(BASE, 1, axis=1),
    0.03 * np.cos(5 * TIME)[:, None, None] * np.array([[[0.0, 1.0, 0.0]] * 2]),
)
NOISE = Noise(0.001, 0.0, "test", "m", 0.01)


class FakePool:
    """Of a problem that says which numbers it is simulated with."""

    def __init__(self, problem: Any, workers: int) -> None:
        self.problem, self.workers, self.count = problem, workers, 1

    def __enter__(self) -> "FakePool":
        return self

    def __exit__(self, *exception: object) -> None:
        pass


@pytest.mark.parametrize(("step", "engine"), [(0.5, 0.7), (-0.5, 0.7), (0.5, -0.7), (-0.5, -0.7)])
def test_a_change_that_leads_away_from_the_measurement_is_left_out(
    monkeypatch: pytest.MonkeyPatch, step: float, engine: float
) -> None:
    measured = Recording("r", PointSeries(TIME, BASE + step * STEP + engine * ENGINE))
    points = {"mine": BASE, "finer": BASE + STEP, "theirs": BASE + ENGINE}

    def predicted(pool: FakePool, values: object, names: object) -> dict[str, PointSeries]:
        return {"r": PointSeries(TIME, points[pool.problem.simulator.name])}

    made = {name: SimpleNamespace(name=name) for name in points}
    made["mine"].finer = lambda: made["finer"]
    monkeypatch.setattr(module, "replace", lambda thing, **new: SimpleNamespace(**{**vars(thing), **new}))
    monkeypatch.setattr(module, "SimulationPool", FakePool)
    monkeypatch.setattr(module, "_predicted", predicted)
    monkeypatch.setattr(module, "_others", lambda simulator: [made["theirs"]])
    monkeypatch.setattr(module, "refined", lambda scenario: None)
    problem = SimpleNamespace(
        fit_on=("r",),
        hold_out=(),
        recordings={"r": measured},
        scenarios={"r": None},
        effects={},
        simulator=made["mine"],
    )
    found = numerics(FakePool(problem, 1), {}, NOISE, Offsets())  # type: ignore[arg-type]
    kept = [amount for amount in (step, engine) if amount > 0]
    assert found.directions.get("r", np.zeros((1, 0))).shape[1] == 2 * len(kept)
    assert set(found.moved) == {"step", "theirs"}
