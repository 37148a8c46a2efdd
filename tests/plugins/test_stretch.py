"""Anisotropy and strain stiffening."""

import numpy as np
import pytest
from effect_objects import G, engine

from muslin.core.body import cloth_grid, rope_line
from muslin.core.errors import InputError
from muslin.core.material import ClothMaterial, RopeMaterial
from muslin.core.motion import Motion
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.core.scene import Scene
from muslin.core.simulator import State
from muslin.core.testing.reference import ReferenceSimulator
from muslin.plugins.effects.rope import TwistStiffness
from muslin.plugins.effects.stretch import MIDDLE_STRAIN, Anisotropy, SheetStrain, StrainStiffening

SHEET = cloth_grid(0.1, 0.1, 4, 4)


class Plain(ReferenceSimulator):
    name = "plain"
    capabilities = frozenset()


def task(body, grasp, **more):
    return Scenario(
        name="test",
        body=body,
        grasps=(np.asarray(grasp),),
        motion=Motion.still(),
        times=np.array([0.0, 0.01]),
        markers=np.eye(len(body.vertices)),
        **{"load_vertices": np.zeros(0, np.int64), **more},
    )


def test_anisotropy_multiplies_the_ratios_and_leaves_the_means():
    effect = Anisotropy(log_stretch_ratio=np.log(3.0), log_bending_ratio=-np.log(2.0))
    made = effect.on_material(ClothMaterial(weft_stretch_ratio=0.5))
    assert made.weft_stretch_ratio == pytest.approx(1.5)
    assert made.weft_bending_ratio == pytest.approx(0.5)
    assert (made.stretch_stiffness, made.bending_rigidity) == (
        ClothMaterial().stretch_stiffness,
        ClothMaterial().bending_rigidity,
    )


def test_anisotropy_twice_is_the_sum_of_the_logarithms():
    one, two = Anisotropy(log_stretch_ratio=0.4), Anisotropy(log_stretch_ratio=-0.1)
    both = Anisotropy(log_stretch_ratio=0.3).on_material(ClothMaterial())
    assert one.on_material(two.on_material(ClothMaterial())).weft_stretch_ratio == pytest.approx(
        both.weft_stretch_ratio
    )


@pytest.mark.parametrize(
    ("effect", "body", "material"),
    [
        (Anisotropy(log_stretch_ratio=1.0), SHEET, ClothMaterial()),
        (StrainStiffening(stiffening=1.0), SHEET, ClothMaterial()),
        (TwistStiffness(twist_rigidity=1e-4), rope_line(np.array([[0, 0, 0], [0, 0, -0.2]]), 4), RopeMaterial()),
    ],
)
def test_an_engine_that_cannot_is_refused(effect, body, material):
    with pytest.raises(InputError, match=f"'{effect.name}' needs a simulator that can"):
        rollout(Plain(), task(body, [0]), material, [effect])


def test_twist_stiffness_adds_to_that_of_the_rope():
    made = TwistStiffness(twist_rigidity=3e-4).on_material(RopeMaterial(twist_rigidity=1e-4))
    assert made.twist_rigidity == pytest.approx(4e-4)


def test_the_strain_of_a_sheet_is_the_largest_principal_stretch():
    """Of random deformations, as by singular values; turning it changes nothing."""
    strain, rng = SheetStrain(SHEET), np.random.default_rng(0)
    for _ in range(20):
        gradient = np.eye(3) + 0.3 * rng.normal(size=(3, 3))
        largest = np.linalg.svd(gradient[:, [0, 2]], compute_uv=False)[0]  # the sheet is in the x-z plane
        np.testing.assert_allclose(strain(SHEET.vertices @ gradient.T + [1.0, 2.0, 3.0]), largest - 1.0, rtol=1e-9)


@pytest.mark.parametrize("stiffening", [-0.4, 7.0])
def test_the_factor_follows_its_law(stiffening):
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0]]), 9)
    scene = Scene(body, RopeMaterial(), np.zeros(3), (), np.zeros(9))
    factor = StrainStiffening(stiffening=stiffening).bind_stiffness(scene)
    for strain, share in ((0.0, 0.0), (-0.2, 0.0), (MIDDLE_STRAIN, 0.5), (3 * MIDDLE_STRAIN, 0.9), (1e3, 1.0)):
        got = factor(0.0, State((1 + strain) * body.vertices, 0 * body.vertices))
        np.testing.assert_allclose(got, 1 + stiffening * share, rtol=1e-6)


@pytest.mark.parametrize("name", ["reference", "mujoco", "pybullet"])
@pytest.mark.parametrize("kind", ["cloth", "rope"])
@pytest.mark.parametrize("stiffening", [-0.4, 4.0])
def test_a_loaded_strip_stretches_by_the_closed_form(name, kind, stiffening):
    """Load = factor(e) times the load that stretches the same strip by e without the effect."""
    simulator = ReferenceSimulator() if name == "reference" else engine(name)
    if kind not in simulator.object_kinds or "varying-stiffness" not in simulator.capabilities:
        pytest.skip(f"{name} cannot change the stiffness of a {kind}")
    if kind == "cloth":
        body, held = cloth_grid(0.02, 0.1, 2, 6), [0, 1]
        material = ClothMaterial(stretch_stiffness=100.0, poisson_ratio=0.0, areal_density=1.0, damping_time=0.02)
    else:
        body, held = rope_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.1]]), 6), [0]
        material = RopeMaterial(stretch_stiffness=2.0, linear_density=0.02, damping_time=0.02)
    last = np.arange(len(body.vertices))[-len(held) :]

    def elongation(load, *effects):
        """Of the last row but one against the first but one, clear of the ends."""
        scenario = task(body, held, load=load, load_vertices=last, settle=0.6)
        seen = rollout(simulator, scenario, material, effects).vertices[-1, :, 2]
        return (seen[len(held)] - seen[-len(held) - 1]) / 0.06 - 1.0

    wanted = 0.06
    factor = 1 + stiffening * wanted**2 / (wanted**2 + MIDDLE_STRAIN**2)
    loads = np.array([0.08, 0.12]) / G
    plain = np.array([elongation(m) for m in loads])
    load = float(loads[0] + np.diff(loads)[0] * (wanted - plain[0]) / np.diff(plain)[0])
    own = 0.02 * 0.05  # half of its own weight stretches it too
    got = elongation(factor * (load + own) - own, StrainStiffening(stiffening=stiffening))
    assert got == pytest.approx(wanted, rel=0.05)
