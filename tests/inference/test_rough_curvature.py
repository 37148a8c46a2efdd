"""What is said to be known of parameters where the residuals answer to next to nothing, against the truth."""

from pathlib import Path

import numpy as np
import pytest
from buckling import buckling_study

from muslin.core.arrays import FloatArray
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.study import SimulationPool
from muslin.inference.discrepancy import Discrepancy
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective, polish
from muslin.inference.residuals import Offsets
from muslin.inference.rough_curvature import seen_past_chance
from muslin.inference.roughness import roughness

COUNT, TRUTH = 60, np.array([0.35, 0.6, 0.4, 0.55, 0.5, 0.45])


class Rough(Objective):
    """Residuals that are linear in a few parameters, noise, and a chance that no neighbour shares.

    Args:
        seed: of the problem.
        size: standard deviation of chance, in units of the noise.
        parameters: how many.
    """

    def __init__(self, seed: int, size: float, parameters: int = 2) -> None:
        space = ParameterSpace(tuple(Parameter(name, "1", 0, 1) for name in "abcdef"[:parameters]))
        discrepancy = Discrepancy(chance={"all": np.full(COUNT, size**2)})
        super().__init__(None, space, ["all"], Noise(1.0, 0.0, "test", "m", 0.01), Offsets(), discrepancy=discrepancy)  # type: ignore[arg-type]
        rng = np.random.default_rng(seed)
        self.seed, self.size = seed, size
        self.matrix, self.error = rng.normal(size=(COUNT, parameters)) * 5, rng.normal(size=COUNT)

    wall = 1.0

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        return [self.discrepancy.whitened("all", self.raw(u)) if u[0] <= self.wall else None for u in units]

    def raw(self, unit: FloatArray) -> FloatArray:
        chance = np.random.default_rng([self.seed, *unit.view(np.uint64).tolist()]).normal(size=COUNT)
        return np.asarray(self.matrix @ (unit - TRUTH[: len(unit)]) + self.error + self.size * chance)


def away(size: float, *, wide: bool, parameters: int = 2) -> FloatArray:
    """How far estimates are from the truth [standard deviations] ``(40, D)``."""
    found = []
    for seed in range(40):
        objective = Rough(seed, size, parameters)
        best = polish(objective, np.full(parameters, 0.5))
        best = seen_past_chance(objective, best) if wide else best
        found.append((best.unit - TRUTH[:parameters]) / np.sqrt(np.diag(best.covariance)))
    return np.array(found)


def test_intervals_hold_the_truth_where_chance_decides() -> None:
    assert np.mean(np.abs(away(0.4, wide=False)) < 1.645) < 0.3  # derivatives are of chance
    held = np.mean(np.abs(away(0.4, wide=True)) < 1.645)
    assert held > 0.85
    assert np.std(away(0.4, wide=True)) > 0.15  # and not by saying nothing


@pytest.mark.parametrize("size", [0.2, 0.6])
def test_intervals_are_no_wider_for_more_parameters(size: float) -> None:
    found = away(size, wide=True, parameters=6)
    assert np.mean(np.abs(found) < 1.645) > 0.85
    assert np.std(found) > 0.6


def test_nothing_changes_where_there_is_no_chance() -> None:
    objective = Rough(3, 0.0)
    best = polish(objective, np.array([0.5, 0.5]))
    assert seen_past_chance(objective, best) is best


def test_no_less_is_known_than_the_prior_says() -> None:
    objective = Rough(4, 0.9)
    objective.matrix *= 1e-3
    best = seen_past_chance(objective, polish(objective, np.array([0.5, 0.5])))
    assert (np.diag(best.covariance) <= 1.0 / 12.0 + 1e-12).all()


def test_luck_that_a_covariance_is_grown_by_is_told() -> None:
    """So that it can be taken off again, where another reason counts instead of it."""
    objective = Rough(0, 0.4)
    plain = polish(objective, np.array([0.5, 0.5]))
    told = seen_past_chance(objective, plain)
    by_slopes = told.covariance / told.grown
    assert told.grown > 1.2
    assert (np.diag(by_slopes) < np.diag(told.covariance)).all() and plain.grown == 1.0


def test_nothing_changes_where_neighbours_cannot_be_simulated() -> None:
    objective = Rough(5, 0.4)
    best = polish(objective, np.array([0.5, 0.5]))
    objective.wall = best.unit[0] + 1e-6
    assert seen_past_chance(objective, best) is best


def test_a_rope_that_buckles_is_not_told_too_surely(tmp_path: Path) -> None:
    """Where a search ends there is left to chance, which processors differ in; so of several, most."""
    pytest.importorskip("mujoco")
    problem, noise = buckling_study(tmp_path).problem, Noise(0.001, 0.0, "test", "m", 0.01)
    truth = np.full(len(problem.space), 0.5)
    by_slopes, past_chance = [], []
    with SimulationPool(problem, 0) as pool:
        rough = roughness(pool, problem.space, truth, ("down",))
        discrepancy = rough.discrepancy(problem.recordings, noise, Offsets())
        objective = Objective(pool, problem.space, ("down",), noise, Offsets(), discrepancy=discrepancy)
        for start in truth + 0.05 * np.array([(-1, -1), (1, 1), (-1, 1), (1, -1), (-0.9, -1), (0.6, 0.8)]):
            near = polish(objective, start)
            seen = seen_past_chance(objective, near)
            away = np.abs(near.unit - truth)
            by_slopes.append((away > 10 * np.sqrt(np.diag(near.covariance))).any())
            past_chance.append((away > 3 * np.sqrt(np.diag(seen.covariance))).any())
    assert sum(by_slopes) >= 3
    assert sum(past_chance) <= 2
