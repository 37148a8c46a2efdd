"""What the effects on bending, stretch, twist and grasp declare, and the kit on every engine that can do them."""

import re

import pytest
from effect_objects import engine

from muslin.core.effect import Effect
from muslin.core.registry import REGISTRY
from muslin.core.testing import check_effect
from muslin.core.testing.reference import ReferenceSimulator

DECLARED = {
    "anisotropy": ("material", {"log_stretch_ratio": "1", "log_bending_ratio": "1"}),
    "bending-hysteresis": ("force", {"friction_moment": "N"}),
    "crease": ("force", {"yield_radius": "m"}),
    "grasp-compliance": ("grasp", {"compliance": "m/N", "turn_compliance": "rad/(N m)"}),
    "grasp-slip": ("grasp", {"slipperiness": "1/N"}),
    "rope-hysteresis": ("force", {"friction_moment": "N m"}),
    "strain-stiffening": ("material", {"stiffening": "1"}),
    "twist-stiffness": ("material", {"twist_rigidity": "N m2"}),
}


@pytest.mark.parametrize("simulator", ["reference", "mujoco", "pybullet"])
@pytest.mark.parametrize("name", DECLARED)
def test_keeps_what_effects_promise(name, simulator):
    effect = REGISTRY.get("effect", name)
    made = ReferenceSimulator() if simulator == "reference" else engine(simulator)
    if not effect.needs <= made.capabilities:
        pytest.skip(f"{simulator} cannot do what {name} needs")
    check_effect(effect, made)


@pytest.mark.parametrize("name", DECLARED)
def test_declares_its_place_units_source_and_symptom(name):
    effect = REGISTRY.get("effect", name)
    acts_on, units = DECLARED[name]
    assert (effect.name, effect.acts_on) == (name, acts_on)
    assert {c.name: c.unit for c in effect.coefficients} == units
    assert all(c.description for c in effect.coefficients)
    assert effect.symptom != Effect.symptom
    assert re.search(r"References:\s+[A-Z][a-z]+.*\b(19|20)\d\d\b", effect.__doc__, re.DOTALL)
