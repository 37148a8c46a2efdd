"""Draws that cannot be simulated: counted, explained, placed in the prior, and kept out of the posterior's way."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from small import small_measurement, write_study

from muslin.core.effect import Effect
from muslin.core.errors import MuslinError, RolloutFailed
from muslin.core.material import Material
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.registry import REGISTRY
from muslin.core.study import Study
from muslin.inference.sequential.failures import (
    failure_notes,
    reasons_text,
    region_text,
    share_next_to_failed,
)

SPACE = ParameterSpace((Parameter("stiffness", "N/m", 10.0, 1000.0, "log"), Parameter("friction", "1", 0.0, 1.0)))


class Brittle(Effect):
    """Blows up where the stretch stiffness is above its limit."""

    name = "brittle"
    acts_on = "material"
    coefficients = (Parameter("limit", "N/m", 0.0, 1e6),)

    def on_material(self, material: Material) -> Material:
        stiffness = getattr(material, "stretch_stiffness", 0.0)
        if stiffness > self.values["limit"]:
            raise RolloutFailed(f"an edge is stretched {stiffness / 100:.1f} times at 0.050 s")
        return material


@pytest.fixture
def brittle() -> Iterator[None]:
    REGISTRY.add("effect", "brittle", Brittle)
    yield
    del REGISTRY._objects["effect", "brittle"]


def study(folder: Path, limit: float, **keys: object) -> Study:
    path = write_study(folder, small_measurement(), **keys)
    path.write_text(path.read_text() + f"\n[effects.brittle]\nlimit = {limit}\n")
    return Study.load(path, workers=0)


@pytest.mark.slow
def test_a_fit_goes_on_where_draws_fail_and_says_how_many_why_and_where(brittle: None, tmp_path: Path) -> None:
    result = study(tmp_path, 1000.0).fit()
    (note,) = [w for w in result.warnings if "could not be simulated" in w]
    assert f"{result.failed} of 32 draws could not be simulated: {result.failed} times 'an edge is stretched" in note
    assert "all of them have stretch_stiffness above 1" in note
    assert "N/m, where 100% of the draws fail" in note
    assert note in result.text()
    assert 3 <= result.failed <= 16  # a quarter of the prior of the first round; the truth is at 200 N/m
    assert result.values()["stretch_stiffness"] == pytest.approx(200.0, rel=0.2)


@pytest.mark.parametrize(
    ("limit", "keys", "words"),
    [
        (1.0, {}, "16 of 16 draws could not be simulated: 16 times 'an edge is stretched [0-9.]+ times"),
        (1e6, {"time_limit": 1e-4}, "16 of 16 draws could not be simulated: 16 times 'took longer than 0.0001 s"),
    ],
)
def test_when_all_draws_fail_the_reasons_are_the_error(
    brittle: None, tmp_path: Path, limit: float, keys: dict[str, object], words: str
) -> None:
    with pytest.raises(MuslinError, match=words):
        study(tmp_path, limit, **keys).fit()


def test_where_a_few_of_a_few_draws_fail_more_draws_are_asked_for(brittle: None, tmp_path: Path) -> None:
    made = study(tmp_path, 1000.0)
    made.config.estimator.draws = 10
    with pytest.raises(MuslinError, match=r"[1-4] of 10 draws .* At least 10 .* raise \[estimator\] draws"):
        made.fit()


def test_a_hopeless_first_round_is_not_simulated_to_its_end(brittle: None, tmp_path: Path) -> None:
    made = study(tmp_path, 1.0)
    made.config.estimator.draws = 500
    with pytest.raises(MuslinError, match="20 of 20 draws"):
        made.fit()


def test_reasons_that_differ_in_numbers_alone_are_one_reason() -> None:
    reasons = ["at 0.1 s", "lost", "at 0.25 s", "at 1e-3 s", "lost", "a", "b", "c"]
    assert reasons_text(reasons, most=2) == "3 times 'at 0.1 s'; 2 times 'lost'; 3 times something else"


@pytest.fixture
def cube() -> np.ndarray:
    return np.random.default_rng(0).random((400, 2))


def test_the_region_of_failures_is_the_bound_that_leaves_fewest_whole_draws_out(cube: np.ndarray) -> None:
    stiff = region_text(SPACE, cube, cube[:, 0] > 0.8)
    assert stiff.startswith("all of them have stiffness above 4")  # 10^(1 + 2 * 0.8) = 398 N/m, and the next draw
    assert stiff.endswith("N/m, where 100% of the draws fail")
    assert "friction below 0.29" in region_text(SPACE, cube, cube[:, 1] < 0.3)
    half = (cube[:, 0] > 0.8) & (np.arange(400) % 2 == 0)
    assert re.search("where (4[5-9]|5[0-5])% of", region_text(SPACE, cube, half))
    stray = cube[:, 0] > 0.8
    stray[np.argmin(cube[:, 0])] = True
    assert region_text(SPACE, cube, stray).startswith("nine in ten of them have stiffness above")


def test_failures_anywhere_few_failures_and_nothing_but_failures_have_no_region(cube: np.ndarray) -> None:
    anywhere = np.random.default_rng(1).random(400) < 0.2
    assert region_text(SPACE, cube, anywhere) == ""
    assert region_text(SPACE, cube, np.arange(400) < 3) == ""
    assert region_text(SPACE, cube, np.ones(400, bool)) == ""


def test_a_posterior_next_to_failures_is_doubtful(cube: np.ndarray) -> None:
    failed = cube[:, 0] > 0.5
    rng = np.random.default_rng(2)
    inside, beside = 0.2 + 0.1 * rng.random((300, 2)), 0.45 + 0.1 * rng.random((300, 2))
    assert share_next_to_failed(inside, cube, failed) == 0.0
    assert 0.3 < share_next_to_failed(beside, cube, failed) < 0.7
    reasons = ["lost"] * int(failed.sum())
    assert len(failure_notes(SPACE, cube, failed, reasons, inside)) == 1
    assert "cut off there" in failure_notes(SPACE, cube, failed, reasons, beside)[1]
    assert failure_notes(SPACE, cube, np.zeros(400, bool), [], inside) == []
