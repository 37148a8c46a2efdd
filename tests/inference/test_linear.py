"""The first look: least squares of a linear model inside the unit cube, and the shortest span of most of an error."""

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.criticism.linear import JOINT_STEP, STEP, least_square, look_at
from muslin.inference.criticism.where import _shortest
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective, Polished
from muslin.inference.residuals import Offsets


def test_a_solution_inside_the_cube_is_found_and_its_square_told() -> None:
    rng = np.random.default_rng(0)
    j = 100 * rng.normal(size=(60, 3))
    truth = np.array([0.4, 0.6, 0.5])
    start = np.array([0.5, 0.5, 0.5])
    noise = rng.normal(size=60)
    white = noise - j @ (truth - start)
    at, rss = least_square(start, white, j)
    np.testing.assert_allclose(at, truth, atol=0.02)
    assert rss == pytest.approx(float(np.sum((white + j @ (at - start)) ** 2)), rel=1e-6)
    assert rss < noise @ noise + 1


def test_a_solution_outside_stops_at_the_wall() -> None:
    j = np.eye(2) * 50
    at, rss = least_square(np.array([0.5, 0.5]), np.array([-100.0, 5.0]), j)
    assert at[0] == pytest.approx(0.99, abs=1e-6)
    assert at[1] == pytest.approx(0.4, abs=0.01)
    assert rss > 75.0**2


def test_a_start_on_a_face_is_no_error() -> None:
    at, _ = least_square(np.array([0.0, 1.0]), np.array([-10.0, 5.0]), np.eye(2) * 50)
    assert at[0] == pytest.approx(0.2, abs=0.01)
    assert at[1] == pytest.approx(0.9, abs=0.01)


@pytest.mark.parametrize(
    ("weights", "span"), [([0, 0, 9, 0, 1], (2, 2)), ([1, 1, 1, 1, 1], (0, 2)), ([5, 0, 0, 0, 5], (0, 4))]
)
def test_the_shortest_span_holds_most(weights: list[float], span: tuple[int, int]) -> None:
    assert _shortest(np.array(weights, float)) == span


class Slip(Objective):
    """A stiffness, and a slip that does nothing up to ``threshold`` and moves by ``size`` noises beyond it."""

    def __init__(self, threshold: float, size: float) -> None:
        space = ParameterSpace((Parameter("stiffness", "N", 0, 1), Parameter("slip.rate", "1", 0, 1)))
        super().__init__(None, space, [], Noise(1.0, 0.0, "test", "m", 0.01), Offsets())  # type: ignore[arg-type]
        self.threshold, self.size = threshold, size
        rng = np.random.default_rng(0)
        self.stiff, self.moved, self.noise = rng.normal(size=50) * 10, rng.normal(size=50), rng.normal(size=50)

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        return [
            self.noise + self.stiff * (u[0] - 0.5) + self.size * self.moved * max(0.0, u[1] - self.threshold)
            for u in units
        ]

    def plain(self) -> Polished:
        white = self.many(np.array([[0.5, 0.0]]))[0]
        assert white is not None
        return Polished(np.array([0.5]), white, self.stiff[:, None], np.eye(1), 50.0)


def test_a_look_tells_how_large_the_response_is() -> None:
    objective = Slip(0.0, 10.0)
    look = look_at("slip", objective, objective.plain())
    assert look.step == STEP and look.reach == pytest.approx(1.0, rel=0.3)
    np.testing.assert_allclose(look.along(0.05), [0.5, 0.05])
    assert (look.along(2.0) <= 1.0).all()


def test_what_does_nothing_at_first_is_moved_further() -> None:
    objective = Slip(0.3, 10.0)
    look = look_at("slip", objective, objective.plain())
    assert look.responds and look.step > 0.3
    nothing = Slip(2.0, 10.0)
    assert not look_at("slip", nothing, nothing.plain()).responds


class Wet(Slip):
    """Water moves by the product of how much there is and how far it reaches."""

    def __init__(self, size: float) -> None:
        super().__init__(0.0, size)
        more = (Parameter("slip.extent", "1", -0.25, 0.75),)
        self.space = ParameterSpace(tuple(self.space) + more)

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        return super().many([(u[0], u[1] * (u[2] - 0.25)) for u in units])


def test_coefficients_that_do_nothing_alone_are_moved_together() -> None:
    objective = Wet(10.0)
    plain = Polished(np.array([0.5]), objective.noise, objective.stiff[:, None], np.eye(1), 50.0)
    look = look_at("slip", objective, plain)
    assert look.responds and look.step == JOINT_STEP
    together = np.array([0.5, JOINT_STEP, 0.25 + JOINT_STEP])
    (seen,) = objective.many(together[None])
    np.testing.assert_allclose(plain.white + look.jacobian @ (together - look.start), seen)
    assert look.reach == pytest.approx(np.linalg.norm(seen - plain.white) / np.sqrt(plain.rss))
    nothing = Wet(0.0)
    assert not look_at("slip", nothing, plain).responds
