"""Least squares by derivatives: quick along a bent valley, within the budget, and honest about a kink."""

import numpy as np
import pytest
from test_polish import Bent, Kink, Linear

from muslin.core.arrays import FloatArray
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.descent import _updated, descend
from muslin.inference.polish import polish
from muslin.inference.secants import Found


class Winding(Linear):
    """A narrow valley that winds through six dimensions, with a misfit at its bottom; ``calls`` are counted."""

    def __init__(self, smooth: bool) -> None:
        super().__init__(2.0)
        self.smooth, self.calls = smooth, 0
        self.space = ParameterSpace(tuple(Parameter(n, "1", 0, 1) for n in "abcdef"))

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        self.calls += len(units)
        misfit = 4.0 * np.random.default_rng(3).normal(size=100)
        return [
            np.concatenate([200.0 * (u[1:] - 0.3 - 0.4 * np.sin(4.0 * u[:-1])), [20.0 * (0.7 - u[0])], misfit])
            for u in units
        ]


def found_by(
    objective: Linear, start: FloatArray, evaluations: int = 60, known: bool = False
) -> tuple[Found, int, bool]:
    white = objective.one(start)
    slopes = objective.jacobian(start, white) if known else np.zeros((len(white), len(start)))
    at = Found(start, white, slopes)
    count = float(len(white))
    return descend(
        objective.many, objective.jacobian, at, evaluations, enough=0.3 / count, least=0.002, noise=count, known=known
    )


def test_a_winding_valley_takes_it_half_of_what_secants_take() -> None:
    start, bottom = np.full(6, 0.5), float(np.sum((4.0 * np.random.default_rng(3).normal(size=100)) ** 2))
    taken = []
    for smooth in (False, True):
        objective = Winding(smooth)
        best = polish(objective, start, 400)
        assert best.rested and best.rss < 1.01 * bottom
        taken.append(objective.calls)
    assert taken[1] < 0.55 * taken[0]


def test_derivatives_at_the_end_are_those_of_where_it_ends() -> None:
    found, _, rested = found_by(Bent(2.0), np.array([0.1, 0.9]))
    assert rested
    np.testing.assert_allclose(found.unit, [0.8, 0.64], atol=2e-3)
    np.testing.assert_allclose(found.jacobian[:2], [[-600 * 0.8, 300], [-30, 0]], rtol=0.02, atol=0.5)


@pytest.mark.parametrize("evaluations", [1, 3, 6, 11])
def test_it_takes_no_more_than_it_may_but_for_the_last_derivatives(evaluations: int) -> None:
    objective = Winding(True)
    found, used, rested = found_by(objective, np.full(6, 0.5), evaluations)
    assert objective.calls == 1 + used <= 1 + evaluations + 6 and not rested
    fresh = objective.jacobian(found.unit, found.white)
    np.testing.assert_array_equal(found.jacobian, fresh)


def test_what_is_known_is_not_asked_for_again() -> None:
    objective = Winding(True)
    found_by(objective, np.full(6, 0.5), 1, known=True)
    first = 1 + 6 + 1  # there, its derivatives, a step
    assert objective.calls == first + 6


@pytest.mark.parametrize("wall", [0.4005, 0.43, 0.5])
def test_where_nothing_can_be_simulated_a_little_farther_on_is_no_rest(wall: float) -> None:
    linear, start = Linear(wall), np.array([0.35, 0.1])  # the minimum is at 0.4 and 0.7
    found, _, rested = found_by(linear, start)
    assert rested == (np.abs(found.unit - [0.4, 0.7]).max() < 1e-6) == (wall == 0.5)
    linear.smooth = True
    assert polish(linear, start).unit == pytest.approx([0.4, 0.7], abs=1e-3)


def test_a_kink_is_no_rest() -> None:
    kink = Kink()
    found, _, rested = found_by(kink, np.array([0.65, 0.6]))
    assert not rested and found.unit[0] == pytest.approx(0.6, abs=0.005)  # where secants look around


def test_derivatives_are_not_taken_anew_while_steps_come_true() -> None:
    """Three steps to the minimum of a linear problem, as far as they may go, and derivatives at both its ends."""
    linear = Linear(2.0)
    asked = list[FloatArray]()

    def derivatives(unit: FloatArray, white: FloatArray) -> FloatArray:
        asked.append(unit)
        return linear.matrix

    start = np.array([0.95, 0.7])
    at = Found(start, linear.one(start), np.zeros((40, 2)))
    found, used, rested = descend(linear.many, derivatives, at, 60, enough=0.01, least=0.002)
    assert rested and found.unit == pytest.approx([0.4, 0.7], abs=1e-6)
    assert used > 2 * 2 + 2 and len(asked) == 2


def test_what_a_step_did_is_in_the_derivatives_behind_it() -> None:
    winding, start, step = Winding(True), np.full(6, 0.5), np.linspace(-0.02, 0.03, 6)
    white = winding.one(start)
    at = Found(start, white, winding.jacobian(start, white))
    behind = _updated(at, step, winding.one(start + step))
    np.testing.assert_allclose(behind.jacobian @ step, behind.white - white, atol=1e-9)
    across = np.array([0.03, 0.0, 0.0, 0.0, 0.0, 0.02])  # of which the step tells nothing
    np.testing.assert_allclose(behind.jacobian @ across, at.jacobian @ across, atol=1e-9)


class Lacking(Bent):
    """A bent valley, and residuals that no parameter reaches."""

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        return [np.append(row, np.full(4000, 2.5)) for row in super().many(units) if row is not None]


@pytest.mark.parametrize("as_noise", [False, True])
def test_what_gains_little_beside_what_is_left_is_gone_after_once(as_noise: bool) -> None:
    lacking, start = Lacking(2.0), np.array([0.75, 0.57])
    white = lacking.one(start)
    at = Found(start, white, lacking.jacobian(start, white))
    noise = float(white[42:] @ white[42:]) + 40.0 if as_noise else 0.0
    steps = list[FloatArray]()

    def many(units: FloatArray) -> list[FloatArray | None]:
        steps.extend(units)
        return lacking.many(units)

    _, _, rested = descend(many, lacking.jacobian, at, 60, enough=1e-9, least=1e-4, noise=noise, known=True)
    assert rested and (len(steps) > 1) == as_noise
