"""What is left of a guessed law once it is refitted."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.criticism.unknown.decision import Case, decide
from muslin.inference.criticism.unknown.library import Piece
from muslin.inference.criticism.unknown.refit import LAW, Refits, RefittedLaw
from muslin.inference.criticism.unknown.result import law_table, law_text
from muslin.inference.polish import Polished
from muslin.plugins.effects.law import Law

COUNT = 1000
DRAG = Piece("linear drag", ("linear_drag",))
WAVE = Piece("oscillating acceleration", ("sine_x", "sine_y", "cosine_z"), (("frequency", 2.0),))
PUSH = Piece("uniform acceleration", ("acceleration_x", "acceleration_y"))


class Found(Refits):
    """Whose polish ends at ``values``, each known to 0.1."""

    def __init__(self, values: dict[str, float]) -> None:
        self.values = values

    def _polished(self, law: RefittedLaw) -> RefittedLaw:
        names = law.coefficients
        unit = law.space.to_unit(np.array([0.5, *(self.values[n] for n in names)]))
        width = np.array([p.high - p.low for p in law.space])
        return replace(
            law, fit=Polished(unit, np.ones(COUNT), np.zeros((COUNT, len(unit))), np.diag(0.01 / width**2), COUNT)
        )

    def held_out(self, space: ParameterSpace, unit: np.ndarray) -> dict[str, float]:
        return {"other": 0.003}


def refitted(values: dict[str, float], *pieces: Piece) -> RefittedLaw:
    known = {p.name.removeprefix(f"{LAW}."): p for p in Law.parameters()}
    space = ParameterSpace((Parameter("stiffness", "Pa", 0.0, 1.0), *(known[n] for n in values)))
    start = Polished(np.full(len(space), 0.5), np.ones(COUNT), np.zeros((COUNT, len(space))), np.eye(len(space)), COUNT)
    return Found(values).more(RefittedLaw(pieces, space, 1, start))


def test_a_frequency_goes_with_the_last_that_has_it_and_so_does_the_name() -> None:
    law = refitted({"linear_drag": 3.0, "sine_x": 0.01, "sine_y": 0.2, "frequency": 2.0}, DRAG, WAVE)
    assert (law.name, law.coefficients) == ("linear drag", ("linear_drag",))
    case = Case(9.0 * COUNT, COUNT, {"other": 0.02}, 0.003, 0.01, laws=(law,))
    assert case.penalised(law) == pytest.approx(COUNT + np.log(COUNT))  # one coefficient
    told = law_table(case, decide(case).best)
    assert told["pieces"] == "linear drag" and list(told["terms"]) == ["linear_drag"]


def test_a_frequency_stays_while_anything_has_it() -> None:
    law = refitted({"linear_drag": 0.1, "sine_x": 4.0, "sine_y": 0.01, "frequency": 0.05}, DRAG, WAVE)
    assert (law.name, law.coefficients) == ("oscillating acceleration", ("sine_x", "frequency"))


def test_a_piece_of_which_something_is_left_keeps_its_name() -> None:
    law = refitted({"linear_drag": 3.0, "acceleration_x": 1.0, "acceleration_y": 0.1}, DRAG, PUSH)
    assert (law.name, law.coefficients) == ("linear drag + uniform acceleration", ("linear_drag", "acceleration_x"))


@pytest.mark.parametrize(
    ("left", "name"),
    [
        ({"acceleration_y": 1.0}, "uniform acceleration"),
        ({"spring": 0.05, "acceleration_y": 1.0}, "uniform acceleration"),
        ({"spring": 20.0, "acceleration_y": 1.0}, "spring to a place"),
    ],
)
def test_without_its_stiffness_a_spring_is_no_spring(left: dict[str, float], name: str) -> None:
    spring = Piece("spring to a place", ("spring", "acceleration_x", "acceleration_y", "acceleration_z"))
    assert refitted(left, spring).name == name
    assert refitted({**left, "acceleration_x": 2.0}, PUSH, spring).name.count("uniform acceleration") == 1


def told(law: RefittedLaw, held_out: float) -> tuple[str, str]:
    """What is said of a law that stands, and of one that does not."""
    case = Case(9.0 * COUNT, COUNT, {"other": held_out}, 0.003, 0.01, laws=(law,))
    table = law_table(case, law)
    force = {"recordings": {"a": {"over_weight": 0.1, "root_mean_square": 1e-3, "worst_time": 0.1}}, "explained": 1.0}
    error = {"held_out_before": held_out, "held_out_after": 0.003, "noise": 0.003, "unit": "m"}
    result = {"verdict": "law", "law": table, "force": force, "error": error, "alternatives": []}
    return " ".join(law_text(result)), " ".join(law_text({**result, "verdict": "none", "law": None, "nearest": table}))


def test_a_term_that_its_range_holds_back_is_said_to_be() -> None:
    held, free = refitted({"linear_drag": 9.97}, DRAG), refitted({"linear_drag": 9.0}, DRAG)
    assert (held.at_end, free.at_end) == (("linear_drag",), ())
    assert "The range that is searched ends at linear_drag" in told(held, 0.02)[0]
    assert "ends at" not in told(free, 0.02)[0]


def test_where_a_spring_pulls_to_is_said() -> None:
    spring = Piece("spring to a place", ("spring", "acceleration_x", "acceleration_y", "acceleration_z"))
    plane = Piece("spring to a plane along y", ("spring_y", "acceleration_y"))
    text = told(refitted({"spring": 20.0, "acceleration_y": 6.0, "acceleration_z": -4.0}, spring), 0.02)[0]
    assert "pulls to x 0.000, y 0.300, z -0.200 m from the centre of the start." in text
    assert "pulls to y 0.300 m" in told(refitted({"spring_y": 20.0, "acceleration_y": 6.0}, plane), 0.02)[0]
    for other in ({"spring": -20.0, "acceleration_y": 6.0}, {"spring": 20.0}, {"acceleration_y": 6.0}):
        assert "pulls to" not in told(refitted(other, spring), 0.02)[0]


def test_a_frequency_is_not_held_back_by_zero() -> None:
    assert refitted({"sine_x": 4.0, "frequency": 0.01}, WAVE).at_end == ()


def test_a_law_that_makes_held_out_motions_worse_is_not_said_to_explain_nothing_of_them() -> None:
    law = replace(refitted({"linear_drag": 3.0}, DRAG), held_out={"other": 0.03})
    assert "on fitted recordings, but makes held-out ones worse." in told(law, 0.02)[1]
    assert "and 100 % on held-out ones" in told(refitted({"linear_drag": 3.0}, DRAG), 0.02)[1]
