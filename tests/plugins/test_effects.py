"""What every shipped effect declares and keeps."""

import re

import numpy as np
import pytest
from effect_objects import EFFECTS, engine

from muslin.core.effect import Effect
from muslin.core.errors import InputError
from muslin.core.material import ClothMaterial
from muslin.core.motion import Motion
from muslin.core.registry import REGISTRY
from muslin.core.testing import check_effect
from muslin.plugins.effects.surface import plate_force

DECLARED = {
    "actuator-lag": ("command", {"time_constant": "s"}),
    "air-drag": ("force", {"drag_coefficient": "1", "lift_coefficient": "1"}),
    "gravity-tilt": ("gravity", {"about_x": "rad", "about_y": "rad"}),
    "internal-damping": ("material", {"damping_time": "s"}),
    "viscous-damping": ("force", {"rate": "1/s"}),
    "wind": ("force", {"velocity_x": "m/s", "velocity_y": "m/s"}),
}


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
@pytest.mark.parametrize("name", EFFECTS)
def test_keeps_what_effects_promise_on_a_real_engine(name, simulator):
    """The kit that third parties use, on cloth and solid; the kit's own tests run it on a NumPy engine."""
    check_effect(REGISTRY.get("effect", name), engine(simulator))


@pytest.mark.parametrize("name", EFFECTS)
def test_names_and_units_of_the_parameters(name):
    effect = REGISTRY.get("effect", name)
    acts_on, units = DECLARED[name]
    assert (effect.name, effect.acts_on) == (name, acts_on)
    assert {p.name: p.unit for p in effect.parameters()} == {f"{name}.{c}": unit for c, unit in units.items()}
    assert all(p.low <= 0 <= p.high and p.description for p in effect.parameters())


@pytest.mark.parametrize("name", EFFECTS)
def test_an_unknown_coefficient_is_refused_with_those_it_has(name):
    effect = REGISTRY.get("effect", name)
    with pytest.raises(InputError, match=f"'{name}' has no coefficient 'speed'; it has {effect.coefficients[0].name}"):
        effect(speed=1.0)


@pytest.mark.parametrize("name", EFFECTS)
def test_missing_coefficients_are_zero(name):
    effect = REGISTRY.get("effect", name)
    first, *others = (c.name for c in effect.coefficients)
    assert effect(**{first: 0.01}).values == {first: 0.01, **dict.fromkeys(others, 0.0)}


@pytest.mark.parametrize("name", EFFECTS)
def test_says_what_one_sees_without_it(name):
    """One clause, about the object, of its own."""
    effect = REGISTRY.get("effect", name)
    assert effect.symptom != Effect.symptom
    assert re.fullmatch(r"[a-z].*[^.]", effect.symptom)
    assert len({REGISTRY.get("effect", n).symptom for n in EFFECTS}) == len(EFFECTS)


@pytest.mark.parametrize("name", EFFECTS)
def test_is_documented(name):
    assert len(REGISTRY.get("effect", name).__doc__.split()) > 10


@pytest.mark.parametrize("name", ["air-drag", "wind", "viscous-damping", "internal-damping"])
def test_a_law_of_nature_names_its_source(name):
    """Author and year, in the docstring of the effect or of the plate law that it refers to."""
    text = REGISTRY.get("effect", name).__doc__
    if "plate" in text.lower():
        text += plate_force.__doc__
    assert re.search(r"[A-Z][a-z]+[^.]*\b(18|19|20)\d\d\b", text)


def test_no_effect_reaches_another_place_than_it_declares():
    """The hooks of other places are the identity."""

    gravity, material, motion = (
        np.array([0.0, 0.0, -9.8]),
        ClothMaterial(),
        Motion.from_positions([0, 1], np.ones((2, 1, 3))),
    )
    for name in EFFECTS:
        effect = REGISTRY.get("effect", name)
        made = effect(**{c.name: c.high for c in effect.coefficients})
        changed = {
            "material": made.on_material(material) is not material,
            "gravity": made.on_gravity(gravity) is not gravity,
            "command": made.on_command(motion, 0.005) is not motion,
            "force": effect.bind is not Effect.bind,
        }
        assert [place for place, is_changed in changed.items() if is_changed] == [effect.acts_on]
