"""The ellipsoid around a best fit holds the posterior, whatever the derivatives there said, and little else."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective, Polished, polish
from muslin.inference.residuals import Offsets
from muslin.inference.sequential.ellipsoid import WIDER, Ellipsoid, inner_radius
from muslin.inference.sequential.narrowing import narrowed

CELLS = 1500
RNG = np.random.default_rng(4)
MATRIX, NOISE = RNG.normal(size=(60, 2)), RNG.normal(size=60)
Model = Callable[[FloatArray, FloatArray], list[FloatArray]]


class MadeUp(Objective):
    """Residuals made of one or two functions of two parameters, and noise."""

    def __init__(self, model: Model, left: float = 1.0, wall: float = 2.0) -> None:
        space = ParameterSpace((Parameter("a", "1", 0, 1), Parameter("b", "1", 0, 1)))
        super().__init__(None, space, [], Noise(1.0, 0.0, "test", "m", 0.01), Offsets())  # type: ignore[arg-type]
        self.model, self.wall = model, wall
        self.noise_seen = np.sqrt(left) * NOISE

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        clean = np.stack(self.model(units[:, 0], units[:, 1]), axis=-1) @ MATRIX.T
        return [None if u[0] > self.wall else c + self.noise_seen for u, c in zip(units, clean, strict=True)]


def held(objective: MadeUp, ellipsoid: Ellipsoid, left: float = 1.0) -> tuple[float, float]:
    """Share of the exact posterior on a grid that an ellipsoid holds, and share of the square that it takes."""
    middle = (np.arange(CELLS) + 0.5) / CELLS
    grid = np.stack(np.meshgrid(middle, middle, indexing="ij"), axis=-1).reshape(-1, 2)
    normal, shift = MATRIX.T @ MATRIX, MATRIX.T @ objective.noise_seen
    f = np.stack(objective.model(grid[:, 0], grid[:, 1]), axis=-1)
    log_p = -0.5 * (np.einsum("ni,ij,nj->n", f, normal, f) + 2.0 * f @ shift) / left
    mass = np.exp(log_p - log_p.max()) * (grid[:, 0] <= objective.wall)
    inside = ellipsoid.out(grid) <= 1.0
    return float(mass[inside].sum() / mass.sum()), float(inside.mean())


def straight(a: FloatArray, b: FloatArray) -> list[FloatArray]:
    return [8.0 * (a - 0.4) + 7.0 * (b - 0.6), 2.0 * (a - 0.4) - 2.0 * (b - 0.6)]


def around(objective: MadeUp, best: Polished, starts: FloatArray) -> Ellipsoid:
    found = narrowed(objective, best, starts, np.random.default_rng(1))
    assert found is not None
    return found


#: Each with the least share of the posterior that must be held, and the largest share of the square that may be taken.
CASES: dict[str, tuple[Model, float, float]] = {
    "straight": (straight, 0.995, 0.2),
    "at a bound": (lambda a, b: [6.0 * a, 6.0 * (b - 0.6)], 0.995, 0.2),
    "in a corner": (lambda a, b: [2.0 * (a + 0.05) + 1.8 * (b + 0.05), 1.0 * (a - b)], 0.995, 0.6),
    "flat below a half": (lambda a, b: [9.0 * np.maximum(a - 0.5, 0.0), 6.0 * (b - 0.6)], 0.995, 0.5),
    "says nothing of one": (lambda a, b: [6.0 * (a - 0.4), 0.0 * b], 0.995, 0.5),
    "bent": (lambda a, b: [20.0 * (b - 0.2 - (a - 0.5) ** 2), 1.0 * (a - 0.5)], 0.995, 1.0),  # by no ellipsoid
    "two valleys": (lambda a, b: [30.0 * ((a - 0.5) ** 2 - 0.09), 6.0 * (b - 0.5)], 0.995, 0.8),
}


@pytest.mark.parametrize("name", CASES)
def test_it_holds_the_posterior_and_little_else(name: str) -> None:
    model, least, most = CASES[name]
    objective = MadeUp(model)
    starts = np.random.default_rng(0).random((30, 2))
    best = polish(objective, starts[0])
    inside, share = held(objective, around(objective, best, starts))
    assert inside > least
    assert share <= most


@pytest.mark.parametrize("wrong", [1 / 900, 900.0])
def test_a_covariance_that_is_of_chance_does_no_harm(wrong: float) -> None:
    objective = MadeUp(straight)
    best = polish(objective, np.array([0.5, 0.5]))
    turned = np.array([[1.0, 0.9], [0.9, 1.0]]) * np.trace(best.covariance) / 2.0 * wrong
    ellipsoid = around(objective, replace(best, covariance=turned), np.zeros((0, 2)))
    inside, share = held(objective, ellipsoid)
    exact = np.pi * (WIDER * inner_radius(2)) ** 2 * np.sqrt(np.linalg.det(best.covariance))
    assert inside > 0.995
    assert share < 4.0 * exact


def test_what_is_left_beyond_noise_makes_it_wider() -> None:
    objective = MadeUp(straight, left=9.0)
    best = polish(objective, np.array([0.5, 0.5]))
    left = best.rss / best.count
    assert left > 5.0
    ellipsoid = around(objective, best, np.zeros((0, 2)))
    assert held(objective, ellipsoid, left)[0] > 0.995


def test_it_ends_where_nothing_can_be_simulated() -> None:
    objective = MadeUp(lambda a, b: [0.1 * (a - 0.2), 6.0 * (b - 0.6)], wall=0.5)
    best = polish(objective, np.array([0.2, 0.5]))
    ellipsoid = around(objective, best, np.zeros((0, 2)))
    inside, share = held(objective, ellipsoid)
    assert inside > 0.99 and share < 0.6


def test_draws_are_uniform_on_what_the_cube_holds_of_it() -> None:
    rng = np.random.default_rng(2)
    ellipsoid = Ellipsoid(np.array([0.9, 0.5]), np.array([[0.3, 0.0], [0.1, 0.2]]), rng)
    draws = ellipsoid.sample(50_000, rng)
    assert ((draws >= 0) & (draws <= 1)).all() and (ellipsoid.out(draws) <= 1.0).all()
    everywhere = rng.random((200_000, 2))
    area = np.mean(ellipsoid.out(everywhere) <= 1.0)
    assert np.exp(-ellipsoid.log_prob(draws[:1])[0]) == pytest.approx(area, rel=0.02)
    low = everywhere[(ellipsoid.out(everywhere) <= 1.0)]
    np.testing.assert_allclose(draws.mean(axis=0), low.mean(axis=0), atol=0.005)
    assert ellipsoid.log_prob(np.array([[0.1, 0.1]]))[0] == -np.inf


@pytest.mark.parametrize("dim", [2, 6])
def test_stretched_to_another_place_it_holds_a_copy_there_and_itself(dim: int) -> None:
    rng = np.random.default_rng(3)
    axes, there = 0.05 * rng.normal(size=(dim, dim)), np.full(dim, 0.8)
    first = Ellipsoid(np.full(dim, 0.3), axes, rng)
    ball = rng.normal(size=(4000, dim))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    both = first.stretched(there, rng)
    for center in (first.center, there):
        assert (both.out(center + ball @ axes.T) <= 1.0 + 1e-9).all()
