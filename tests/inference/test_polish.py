"""Least squares over a simulator that sometimes fails: what is not known stays as wide as the prior."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from muslin.core.arrays import FloatArray
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference import polish as polishing
from muslin.inference.discrepancy import Discrepancy
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective, polish, polish_from
from muslin.inference.residuals import Offsets
from muslin.inference.secants import Found


class Linear(Objective):
    """White residuals that are linear in two parameters; beyond ``wall`` of the first nothing can be simulated."""

    by_derivatives = False

    def __init__(self, wall: float) -> None:
        space, noise = ParameterSpace(tuple(Parameter(n, "1", 0, 1) for n in "ab")), Noise(1.0, 0.0, "test", "m", 0.01)
        super().__init__(None, space, [], noise, Offsets(), smooth=self.by_derivatives)  # type: ignore[arg-type]
        self.wall = wall
        self.matrix = np.random.default_rng(0).normal(size=(40, 2)) * 20

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        return [None if u[0] > self.wall else self.matrix @ (u - np.array([0.4, 0.7])) for u in units]


@pytest.fixture(params=[False, True], ids=["secants", "derivatives"])
def either_way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Linear, "by_derivatives", request.param)


@pytest.mark.usefixtures("either_way")
def test_the_minimum_and_its_covariance() -> None:
    best = polish(Linear(2.0), np.array([0.1, 0.1]))
    np.testing.assert_allclose(best.unit, [0.4, 0.7], atol=1e-3)
    matrix = Linear(2.0).matrix
    np.testing.assert_allclose(best.covariance, np.linalg.inv(matrix.T @ matrix + 12 * np.eye(2)), rtol=1e-6)


@pytest.mark.parametrize("left", [0.5, 9.0, 1e6])
def test_what_is_left_beyond_noise_counts_as_noise_and_never_as_less_than_the_prior_knows(left: float) -> None:
    best = polish(Linear(2.0), np.array([0.1, 0.1]))
    matrix = Linear(2.0).matrix
    of_data = matrix.T @ matrix / max(1.0, left)  # as though noise were so much louder
    told = replace(best, white=np.full(40, np.sqrt(left)), count=40.0).widened
    np.testing.assert_allclose(told, np.linalg.inv(of_data + 12 * np.eye(2)), rtol=1e-6)
    assert np.linalg.eigvalsh(told).max() <= 1 / 12


@pytest.mark.usefixtures("either_way")
def test_whether_more_evaluations_would_gain_anything_is_told() -> None:
    assert polish(Linear(2.0), np.array([0.1, 0.1])).rested
    assert not polish(Bent(2.0), np.array([0.1, 0.9]), 5).rested
    assert not polish(Linear(2.0), np.array([0.1, 0.1]), roughly=True).rested
    limits = [polish(Bent(2.0), np.array([0.1, 0.9]), k) for k in range(4, 40)]
    best = min(found.rss for found in limits)
    assert all(found.rss < best + 3.0 for found in limits if found.rested)  # wherever the budget ended


class TwoValleys(Linear):
    """A linear problem that looks like another, which nothing fits, where the first parameter is above a half.

    There ``left`` times what noise leaves is left at least.
    """

    def __init__(self, left: float) -> None:
        super().__init__(2.0)
        outside = np.linalg.svd(self.matrix)[0][:, 2]
        self.left = np.sqrt(left * 40) * outside

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        return [
            self.left + self.matrix @ (u - np.array([0.8, 0.2]))
            if u[0] > 0.5
            else self.matrix @ (u - np.array([0.4, 0.7]))
            for u in units
        ]


@pytest.mark.usefixtures("either_way")
@pytest.mark.parametrize("left", [1.2, 5.0])
def test_another_start_is_tried_where_the_first_leaves_a_misfit(left: float) -> None:
    starts = np.array([[0.9, 0.3], [0.88, 0.31], [0.2, 0.2], [0.1, 0.9]])
    stuck = polish(TwoValleys(left), starts[0])
    assert stuck.rss == pytest.approx(left * stuck.count, rel=1e-3)
    best = polish_from(TwoValleys(left), starts)
    np.testing.assert_allclose(best.unit, [0.4, 0.7], atol=1e-3)
    np.testing.assert_allclose(polish_from(TwoValleys(left), starts[1:], stuck).unit, best.unit, atol=1e-3)
    assert polish_from(TwoValleys(left), starts[:2], stuck) is stuck  # from where it has been nothing is tried


class Bent(Linear):
    """A narrow valley along a parabola (Rosenbrock 1960), with numbers enough to be noise at the bottom."""

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        noise = np.random.default_rng(1).normal(size=40)
        return [np.concatenate([[300.0 * (u[1] - u[0] ** 2), 30.0 * (0.8 - u[0])], noise]) for u in units]


@pytest.mark.usefixtures("either_way")
def test_it_comes_to_the_bottom_of_a_narrow_valley() -> None:
    best = polish(Bent(2.0), np.array([0.1, 0.9]))
    floor = float(np.sum(np.random.default_rng(1).normal(size=40) ** 2))
    assert best.rss < floor + 0.3
    truth = np.array([[-600 * 0.8, 300], [-30, 0]])
    np.testing.assert_allclose(best.jacobian[:2], truth, rtol=0.05, atol=0.5)


class Missing(Linear):
    """A curved problem that lacks something: what no parameter reaches is far more than the noise."""

    calls = 0

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        self.calls += len(units)
        lacks = 8.0 * np.random.default_rng(2).normal(size=40)
        return [self.matrix @ (u + 0.3 * u**2 - np.array([0.4, 0.7])) + lacks for u in units]


@pytest.mark.usefixtures("either_way")
@pytest.mark.parametrize("start", [(0.1, 0.1), (0.9, 0.9), (0.5, 0.1), (0.3, 0.6)])
def test_a_misfit_that_no_parameter_reaches_costs_no_long_search(start: tuple[float, float]) -> None:
    missing = Missing(2.0)
    best = polish(missing, np.array(start))
    assert best.rss > 20 * best.count and missing.calls < 15
    exact = least_squares(missing.one, best.unit, xtol=1e-12, ftol=1e-12, gtol=1e-12).x
    sd = np.sqrt(np.diag(best.covariance) * best.rss / best.count)  # of what is left, noise or not
    assert (np.abs(best.unit - exact) < 0.3 * sd).all()


class Kink(Linear):
    """What a parameter does has a kink above its minimum, and noise that is many times as much."""

    def __init__(self) -> None:
        super().__init__(2.0)
        self.drawn = np.random.default_rng(1).normal(size=4000)

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        return [np.append(self.drawn, [self.signal(u[0]), 30.0 * (u[1] - 0.7)]) for u in units]

    def signal(self, a: float) -> float:
        return 8.0 + 80.0 * abs(a - 0.6) if a > 0.52 else 40.0 * abs(a - 0.4)


@pytest.mark.usefixtures("either_way")
def test_it_looks_around_from_a_kink_where_no_more_than_noise_is_left() -> None:
    kink = Kink()
    on_it = np.array([0.6, 0.7])
    assert float(kink.one(on_it) @ kink.one(on_it)) < 1.05 * kink.count(kink.one(on_it))
    assert polish(kink, np.array([0.65, 0.6])).unit[0] == pytest.approx(0.4, abs=0.02)


def test_derivatives_are_taken_at_the_step_that_is_told() -> None:
    class Noted(Linear):
        asked: FloatArray

        def many(self, units: FloatArray) -> list[FloatArray | None]:
            self.asked = units
            return super().many(units)

    objective, unit = Noted(2.0), np.array([0.5, 1.0])  # a step up would leave the cube
    for step in (1e-4, 2e-3):
        objective.discrepancy = Discrepancy(step=step)
        np.testing.assert_allclose(objective.jacobian(unit), objective.matrix, rtol=1e-6)
        np.testing.assert_allclose(objective.asked - unit, np.diag([step, -step]), atol=1e-12)


def test_a_neighbour_that_fails_does_not_pass_for_certainty() -> None:
    objective = Linear(wall=0.4)
    slope = objective.jacobian(np.array([0.4, 0.5]))  # a step up fails, a step down does not
    np.testing.assert_allclose(slope, objective.matrix, rtol=1e-6)
    objective.wall = 0.001  # one side fails, the other is outside the cube
    assert not objective.jacobian(np.array([0.001, 0.5]))[:, 0].any()


@pytest.mark.parametrize(("gain", "rounds"), [(0.004, 1), (0.05, 3)])
def test_rounds_end_where_one_gains_little_of_what_is_left(
    monkeypatch: pytest.MonkeyPatch, gain: float, rounds: int
) -> None:
    """Of a model that is far off; what noise leaves is told to every search."""
    told, gains = [], iter([0.0, gain, gain, 0.0])

    def seek(many: object, at: Found, evaluations: int, *, noise: float, **_: object) -> tuple[Found, int, bool]:
        told.append(noise)
        return replace(at, white=at.white * np.sqrt(1.0 - next(gains))), 1, True

    monkeypatch.setattr(polishing, "search", seek)
    far = Linear(2.0)
    far.matrix = np.tile(far.matrix, (100, 1))
    assert polish(far, np.array([0.9, 0.1])).rested
    assert len(told) == 1 + rounds and set(told) == {4000.0}
