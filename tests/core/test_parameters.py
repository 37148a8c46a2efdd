import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.core.errors import InputError
from muslin.core.parameters import Parameter, ParameterSpace


@st.composite
def parameters(draw: st.DrawFn, name: str) -> Parameter:
    if draw(st.booleans()):
        low = draw(st.floats(1e-9, 1e6))
        return Parameter(name, "Pa", low, low * draw(st.floats(1.1, 1e6)), "log")
    low = draw(st.floats(-1e6, 1e6))
    return Parameter(name, "m", low, low + draw(st.floats(1e-3, 1e6)))


@st.composite
def spaces(draw: st.DrawFn) -> ParameterSpace:
    return ParameterSpace(tuple(draw(parameters(f"p{k}")) for k in range(draw(st.integers(1, 5)))))


@given(spaces(), st.data())
def test_unit_cube_round_trip(space: ParameterSpace, data: st.DataObject) -> None:
    unit = np.array(data.draw(st.lists(st.floats(0, 1), min_size=len(space), max_size=len(space))))
    values = space.from_unit(unit)
    for p, v in zip(space, values, strict=True):
        slack = 1e-9 * (1.0 + abs(p.low) + abs(p.high))
        assert p.low - slack <= v <= p.high + slack
    # a narrow box far from zero keeps only what doubles can tell apart
    tolerance = [1e-9 if p.scale == "log" else 1e-9 + 1e-15 * abs(p.low) / (p.high - p.low) * 10 for p in space]
    assert (np.abs(space.to_unit(values) - unit) <= tolerance).all()


@given(spaces())
def test_corners_of_the_cube_are_the_bounds(space: ParameterSpace) -> None:
    low, high = np.array([p.low for p in space]), np.array([p.high for p in space])
    np.testing.assert_allclose(space.from_unit(np.zeros(len(space))), low, rtol=1e-9)
    np.testing.assert_allclose(space.from_unit(np.ones(len(space))), high, rtol=1e-9, atol=1e-6)


def test_prior_is_uniform_in_the_logarithm() -> None:
    space = ParameterSpace((Parameter("E", "Pa", 1.0, 1e4, "log"),))
    draws = space.from_unit(np.random.default_rng(0).random((4000, 1)))
    assert abs(float(np.mean(draws < 100.0)) - 0.5) < 0.03


def test_outside_the_box_is_outside_the_cube() -> None:
    space = ParameterSpace((Parameter("E", "Pa", 1.0, 100.0, "log"), Parameter("x", "m", 0.0, 1.0)))
    assert space.to_unit(np.array([0.1, 2.0])).tolist() == pytest.approx([-0.5, 2.0])
    assert space.to_unit(np.array([0.0, 0.5]))[0] < 0


def test_dictionary() -> None:
    space = ParameterSpace((Parameter("a", "m", 0, 1), Parameter("b", "s", 0, 1)))
    assert space.as_dict(np.array([0.25, 0.5])) == {"a": 0.25, "b": 0.5}


@pytest.mark.parametrize(
    ("low", "high", "scale", "words"),
    [
        (1.0, 1.0, "linear", "low must be below high"),
        (0.0, float("inf"), "linear", "finite"),
        (0.0, 1.0, "log", "above zero"),
        (1.0, 2.0, "cubic", "linear"),
    ],
)
def test_bounds_that_cannot_be(low: float, high: float, scale: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Parameter("p", "m", low, high, scale)  # type: ignore[arg-type]


def test_a_name_given_twice() -> None:
    p = Parameter("a", "m", 0, 1)
    with pytest.raises(InputError, match="named twice: a"):
        ParameterSpace((p, p))
