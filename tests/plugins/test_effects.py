"""What every shipped effect declares and keeps."""

import importlib.metadata
import re

import numpy as np
import pytest
from effect_objects import EFFECTS, engine

from muslin.core.effect import Effect
from muslin.core.errors import InputError
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.testing import check_effect
from muslin.core.testing.samples import sample_material, sample_scenario
from muslin.plugins.effects.damping import ViscousDamping
from muslin.plugins.effects.law import Law
from muslin.plugins.effects.surface import plate_force

ALL = "cloth rope solid"
#: What it acts on, the hooks it uses, the kinds of object, and its coefficients with their units.
DECLARED: dict[str, tuple[str, str, str, dict[str, str]]] = {
    "actuator-lag": ("command", "on_command", ALL, {"time_constant": "s"}),
    "added-mass": ("force", "bind on_loads", "cloth", {"fraction": "1"}),
    "adhesion": ("contact", "bind", ALL, {"traction": "Pa"}),
    "air-drag": ("force", "bind", "cloth solid", {"drag_coefficient": "1", "lift_coefficient": "1"}),
    "anisotropic-friction": ("contact", "bind", "cloth", {"excess": "1"}),
    "anisotropy": ("material", "on_material", "cloth", {"log_stretch_ratio": "1", "log_bending_ratio": "1"}),
    "bending-hysteresis": ("force", "bind", "cloth", {"friction_moment": "N"}),
    "camera-latency": ("observation", "on_clock", ALL, {"latency": "s"}),
    "camera-offset": ("observation", "on_points", ALL, {"x": "m", "y": "m", "z": "m"}),
    "camera-rotation": ("observation", "on_points", ALL, {"about_x": "rad", "about_y": "rad", "about_z": "rad"}),
    "capstan-friction": ("contact", "on_material", "rope", {"friction": "1"}),
    "crease": ("force", "bind", "cloth rope", {"yield_radius": "m"}),
    "cylinder-drag": ("force", "bind", "rope", {"drag_coefficient": "1", "friction_coefficient": "1"}),
    "grasp-compliance": (
        "grasp",
        "bind_grasp on_material",
        "cloth rope",
        {"compliance": "m/N", "turn_compliance": "rad/(N m)"},
    ),
    "grasp-slip": ("grasp", "bind_grasp on_material", "cloth rope", {"slipperiness": "1/N"}),
    "gravity-strength": ("gravity", "on_gravity", ALL, {"excess": "m/s2"}),
    "gravity-tilt": ("gravity", "on_gravity", ALL, {"about_x": "rad", "about_y": "rad"}),
    "hem": ("mass", "on_loads", "cloth", {"line_mass": "kg/m"}),
    "internal-damping": ("material", "on_material", ALL, {"damping_time": "s"}),
    "rope-hysteresis": ("force", "bind", "rope", {"sliding_share": "1", "slip_curvature": "1/m"}),
    "rest-curvature": (
        "material",
        "on_body",
        "rope",
        {"share": "1", "even_about_z": "1/m", "even_about_side": "1/m"},
    ),
    "law": ("force", "bind", ALL, {c.name: c.unit for c in Law.coefficients}),
    "stick-slip": ("contact", "bind", ALL, {"excess": "1"}),
    "strain-stiffening": ("material", "bind_stiffness", "cloth rope", {"stiffening": "1"}),
    "table-tilt": ("contact", "on_obstacles", ALL, {"about_x": "rad", "about_y": "rad"}),
    "twist-stiffness": ("material", "on_material", "rope", {"twist_rigidity": "N m2"}),
    "uneven-rigidity": ("material", "on_material", "rope", {"log_end_ratio": "1", "log_far_ratio": "1"}),
    "viscous-damping": ("force", "bind", ALL, {"rate": "1/s"}),
    "wet-patch": ("mass", "on_loads", "cloth rope", {"uptake": "1", "extent": "1"}),
    "wind": ("force", "bind", ALL, {"velocity_x": "m/s", "velocity_y": "m/s"}),
}
#: Those that never give energy. Not so: a crease and strands that slide, which
#: relieve elastic moments and work in doing so.
DISSIPATIVE = {
    "air-drag",
    "anisotropic-friction",
    "bending-hysteresis",
    "capstan-friction",
    "cylinder-drag",
    "internal-damping",
    "stick-slip",
    "viscous-damping",
}
LAWS = (
    "added-mass",
    "adhesion",
    "air-drag",
    "anisotropic-friction",
    "anisotropy",
    "bending-hysteresis",
    "camera-rotation",
    "capstan-friction",
    "crease",
    "cylinder-drag",
    "grasp-compliance",
    "grasp-slip",
    "internal-damping",
    "rest-curvature",
    "rope-hysteresis",
    "stick-slip",
    "strain-stiffening",
    "twist-stiffness",
    "uneven-rigidity",
    "viscous-damping",
    "wind",
)
HOOKS = [name for name in vars(Effect) if name.startswith(("on_", "bind"))]


@pytest.mark.parametrize("simulator", ["mujoco", pytest.param("pybullet", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", EFFECTS)
def test_keeps_what_effects_promise_on_a_real_engine(name, simulator):
    """The kit that third parties use, on all kinds of object; the kit's own tests run it on a NumPy engine."""
    effect, made = REGISTRY.get("effect", name), engine(simulator)
    assert effect.needs <= made.capabilities or simulator != "mujoco", "the kit leaves its rollouts out"
    check_effect(effect, made)


def test_is_in_exactly_one_place():
    """One name, one class, registered from where it is defined; and no two of anything that is installed."""
    assert sorted(DECLARED) == EFFECTS
    for name in EFFECTS:
        [entry] = (e for e in importlib.metadata.entry_points(group="muslin.effects") if e.name == name)
        effect = entry.load()
        assert (effect.name, f"{effect.__module__}:{effect.__name__}") == (name, entry.value)
    installed = [REGISTRY.get("effect", name) for name in REGISTRY.names("effect")]
    for what in (lambda e: e, lambda e: e.name, lambda e: e.symptom, lambda e: e.__doc__):
        assert len({what(e) for e in installed}) == len(installed)


def test_those_that_never_give_energy_say_so():
    assert {name for name in EFFECTS if REGISTRY.get("effect", name).dissipative} == DISSIPATIVE


@pytest.mark.parametrize("name", sorted(DECLARED))
def test_declares_what_it_is_and_reaches_no_other_place(name):
    effect = REGISTRY.get("effect", name)
    acts_on, hooks, kinds, units = DECLARED[name]
    assert (effect.name, effect.acts_on, effect.object_kinds) == (name, acts_on, set(kinds.split()))
    assert {p.name: p.unit for p in effect.parameters()} == {f"{name}.{c}": unit for c, unit in units.items()}
    assert {h for h in HOOKS if getattr(effect, h) is not getattr(Effect, h)} == set(hooks.split())


@pytest.mark.parametrize("name", EFFECTS)
def test_every_range_holds_zero_and_every_coefficient_is_explained(name):
    assert all(p.low <= 0 <= p.high and p.description for p in REGISTRY.get("effect", name).parameters())


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


@pytest.mark.parametrize("name", EFFECTS)
def test_is_documented(name):
    assert len(REGISTRY.get("effect", name).__doc__.split()) > 10


@pytest.mark.parametrize("name", LAWS)
def test_a_law_of_nature_names_its_source(name):
    """Author and year, in the docstring of the effect or of the plate law that it refers to."""
    text = REGISTRY.get("effect", name).__doc__
    if "plate" in text.lower():
        text += plate_force.__doc__
    assert re.search(r"[A-Z][a-z]+[^.]*\b(18|19|20)\d\d\b", text)


@pytest.mark.parametrize("name", sorted(DECLARED))
def test_adds_to_another_effect_whichever_comes_first(name):
    effect = REGISTRY.get("effect", name)
    kind = sorted(effect.object_kinds)[0]
    pair = effect(**{c.name: c.high for c in effect.coefficients}), ViscousDamping(rate=1.5)
    task, material = sample_scenario(kind, 0.1), sample_material(kind)
    plain = engine("reference")
    made = plain if effect.needs <= plain.capabilities else engine("mujoco")
    one, other = (rollout(made, task, material, order).series.points for order in (pair, pair[::-1]))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)
