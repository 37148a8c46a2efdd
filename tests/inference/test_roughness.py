"""What a simulation cannot repeat: found where it is, and neither fitted, nor counted, nor taken for information."""

import numpy as np
import pytest
from buckling import LANDED, buckling_study

from muslin.core.errors import MuslinError
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.rollout import Trajectory
from muslin.core.series import PointSeries
from muslin.core.study import Task
from muslin.inference.discrepancy import LEAST_STEP, MOST_STEP, Discrepancy
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective, polish
from muslin.inference.residuals import Offsets
from muslin.inference.roughness import Roughness, check_repeatable, roughness, unrepeatable
from muslin.inference.sequential.doubts import doubts

NOISE = Noise(0.001, 0.0, "test", "m", 0.01)


@pytest.fixture(scope="module")
def study(tmp_path_factory):  # type: ignore[no-untyped-def]
    return buckling_study(tmp_path_factory.mktemp("buckling"))


def test_it_begins_where_the_rope_buckles(study) -> None:  # type: ignore[no-untyped-def]
    problem = study.problem
    middle = np.full(len(problem.space), 0.5)
    with study.pool() as pool:
        rough = roughness(pool, problem.space, middle, problem.fit_on)
        said = doubts(pool, problem.space, middle, NOISE)
    time = problem.recordings["down"].series.time
    assert rough.sd["up"].max() < 0.1 * NOISE.sd
    assert rough.sd["down"][time < LANDED].max() < 0.1 * NOISE.sd
    assert rough.sd["down"].max() > 3 * NOISE.sd
    (chaotic,) = (sentence for sentence in said if "chaotic" in sentence)
    assert "down from" in chaotic and "up from" not in chaotic
    assert "[study] window" not in chaotic  # pieces of it could not start as measured
    (where,) = unrepeatable(rough, problem.recordings, NOISE)
    assert where.startswith("down from 0.")


class Cubic:
    """A smooth model that bends hard, and chance on top where there is any."""

    def __init__(self, chance: float) -> None:
        self.chance, self.rng = chance, np.random.default_rng(3)

    def map(self, tasks: list[Task]) -> list[Trajectory]:
        time = np.linspace(0.0, 1.0, 50)
        made = []
        for task in tasks:
            x = task.values["stiffness"] + 0.3 * task.values["damping"]
            points = np.full((50, 25, 3), 0.1 * x + 30.0 * x**2 + 3.0 * x**3)
            points[25:] += self.chance * self.rng.normal(size=3)
            made.append(Trajectory(PointSeries(time, points), points, np.zeros((50, 1, 7))))
        return made


def test_a_model_that_bends_is_not_taken_to_be_chance() -> None:
    space = ParameterSpace((Parameter("stiffness", "N/m", 0, 1), Parameter("damping", "1/s", 0, 1)))
    unit = np.array([0.3, 0.7])
    smooth = roughness(Cubic(0.0), space, unit, ["fling"]).sd["fling"]  # type: ignore[arg-type]
    assert smooth.max() < 0.02e-3  # the noise of the best motion capture
    takes = [str(k) for k in range(30)]
    found = np.mean([sd[-1] for sd in roughness(Cubic(0.01), space, unit, takes).sd.values()])  # type: ignore[arg-type]
    assert found == pytest.approx(0.01, rel=0.15)


def test_derivatives_take_short_steps_where_the_model_is_smooth_and_long_ones_where_it_is_not() -> None:
    space = ParameterSpace((Parameter("stiffness", "N/m", 0, 1), Parameter("damping", "1/s", 0, 1)))
    unit = np.array([0.3, 0.7])
    steps = [roughness(Cubic(c), space, unit, ["fling"]).step(NOISE) for c in (0.0, 1e-6, 1e-4)]  # type: ignore[arg-type]
    assert steps[0] == pytest.approx(LEAST_STEP, rel=0.1)
    assert steps == sorted(steps) and steps[2] > 2 * steps[1]
    # 8 ** (1/4) times the root of noise over second derivative; frames that do not count are not asked
    frames = np.array([1e-6, 1e-6, 1.0])
    known = Roughness({"fling": frames}, {"fling": frames}, {"fling": np.array([10.0, 10.0, 0.1])})
    assert known.step(NOISE) == pytest.approx(8**0.25 * np.sqrt(1e-7))
    assert Roughness({}, {}, {}).step(NOISE) == MOST_STEP


def test_a_fit_leaves_it_out(study) -> None:  # type: ignore[no-untyped-def]
    """In the middle of starts beside the truth: each alone may be lucky."""
    problem = study.problem
    unit = np.full(len(problem.space), 0.5)
    left, known = {"blind": [], "sees": []}, {"blind": [], "sees": []}
    with study.pool() as pool:
        aware_of = roughness(pool, problem.space, unit, ["down"]).discrepancy(problem.recordings, NOISE, Offsets())
        plain = Objective(pool, problem.space, ["down"], NOISE, Offsets())
        aware = Objective(pool, problem.space, ["down"], NOISE, Offsets(), discrepancy=aware_of)
        for nudge in (0.002, -0.002, 0.003, -0.003):
            for name, objective in (("blind", plain), ("sees", aware)):
                fitted = polish(objective, unit + nudge, 1)
                left[name].append(fitted.rss / fitted.count)
                known[name].append(np.sqrt(np.diag(fitted.covariance)).max())
    assert np.median(left["blind"]) > 3
    assert np.median(left["sees"]) < 1.1
    assert np.median(known["sees"]) > 5 * np.median(known["blind"])


def test_residuals_are_weighed_by_what_is_known_of_chance() -> None:
    rng = np.random.default_rng(0)
    v = np.array([0.0, 0.5, 4.0])
    d = Discrepancy(chance={"fling": v})
    draws = np.stack([d.whitened("fling", w) for w in rng.normal(size=(4000, 3)) * np.sqrt(1 + v)])
    np.testing.assert_allclose(draws.var(axis=0), [1.0, 1.0, 0.0], rtol=0.1)
    assert d.dropped(["fling", "other"]) == 1
    assert d.left_to_chance(["fling"]) == pytest.approx(1 / 3)
    assert d.left_to_chance(["other"]) == 0.0
    assert not d.nothing_counts(["fling"]) and not d.nothing_counts(["other"])
    nothing = Discrepancy(chance={"fling": v + 2.0})
    assert nothing.nothing_counts(["fling"])
    check_repeatable(d, ["fling"])
    with pytest.raises(MuslinError, match="motions that can be repeated"):
        check_repeatable(nothing, ["fling"])
