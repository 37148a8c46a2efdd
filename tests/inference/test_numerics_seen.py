"""What is said to be known of parameters beside numerical errors, against the truth."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.discrepancy import NONE, Discrepancy
from muslin.inference.noise import Noise
from muslin.inference.numerics_seen import seen_past_numerics
from muslin.inference.polish import Objective, polish
from muslin.inference.residuals import Offsets

COUNT, TRUTH = 120, np.array([0.35, 0.6])
TAKES = ("one", "two", "three")


class Linear(Objective):
    """Three recordings whose residuals are linear in two parameters, with noise and an error of the numbers.

    Args:
        seed: of the problem.
        size: of the error, in units of what other numbers would change.
    """

    def __init__(self, seed: int, size: float) -> None:
        space = ParameterSpace((Parameter("a", "1", 0, 1), Parameter("b", "1", 0, 1)))
        rng = np.random.default_rng(seed)
        self.matrix = rng.normal(size=(len(TAKES), COUNT, 2)) * 5
        shape = self.matrix @ rng.normal(size=(2, 4))  # much as parameters move it
        self.along = shape / 15 + 0.1 * rng.normal(size=(len(TAKES), COUNT, 4))
        chosen = size * rng.normal(size=(len(TAKES), 4, 1))
        self.error = rng.normal(size=(len(TAKES), COUNT)) + (self.along @ chosen)[..., 0]
        directions = dict(zip(TAKES, self.along, strict=True))
        noise = Noise(1.0, 0.0, "test", "m", 0.01)
        super().__init__(None, space, TAKES, noise, Offsets(), discrepancy=Discrepancy(directions))  # type: ignore[arg-type]

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        raw = [self.matrix @ (u - TRUTH) + self.error for u in units]
        white = self.discrepancy.whitened
        return [np.concatenate([white(n, r) for n, r in zip(TAKES, rows, strict=True)]) for rows in raw]


def away(size: float, *, told: bool) -> FloatArray:
    """How far estimates are from the truth [standard deviations] ``(150, 2)``."""
    found = []
    for seed in range(150):
        objective = Linear(seed, size)
        best = polish(objective, np.array([0.5, 0.5]))
        best = seen_past_numerics(objective, best) if told else best
        found.append((best.unit - TRUTH) / np.sqrt(np.diag(best.covariance)))
    return np.array(found)


@pytest.mark.parametrize("size", [0.0, 1.0, 3.0])
def test_intervals_hold_the_truth_however_large_numerical_errors_are(size: float) -> None:
    held = np.mean(np.abs(away(size, told=True)) < 1.645)
    assert 0.85 < held < 0.95


def test_without_being_told_they_are_too_wide_where_there_is_no_error_and_too_narrow_where_it_is_large() -> None:
    assert np.mean(np.abs(away(0.0, told=False)) < 1.645) > 0.95
    assert np.mean(np.abs(away(3.0, told=False)) < 1.645) < 0.6


def test_nothing_changes_where_no_other_numbers_are_known() -> None:
    objective = Linear(0, 1.0)
    best = polish(objective, np.array([0.5, 0.5]))
    for left in ({}, {"one": objective.along[0]}):
        objective.discrepancy = replace(NONE, directions=left)
        assert seen_past_numerics(objective, best) is best
