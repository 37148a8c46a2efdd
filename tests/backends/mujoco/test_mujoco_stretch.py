"""Stretch in the plane: woven cloth, and stiffness that changes during a run."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_scenes import NOWHERE, OBJECTS, along_warp, opened, run, scene

from muslin.backends.mujoco.shell import stretch_forms
from muslin.core.body import cloth_grid
from muslin.core.errors import RolloutFailed
from muslin.core.material import ClothMaterial, with_fields


@pytest.mark.parametrize("ratio", [0.3, 1.0, 4.0])
@pytest.mark.parametrize("angle", [0.0, 45.0, 90.0])
def test_tensile_strip_of_an_orthotropic_lamina(ratio, angle):
    """1 % of strain along, to 1 %; its compliance at an angle to the warp is
    c^4 / S_u + s^4 / S_v + (1 / G - 2 nu / S) c^2 s^2 with S_u = S / sqrt(r), S_v = S sqrt(r), G = S / (2 (1 + nu)).
    """
    s, nu, strain, width, columns = 300.0, 0.3, 0.01, 0.05, 5
    c, si = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    root = np.sqrt(ratio)
    compliance = (c**4 * root + si**4 / root + (2 * (1 + nu) - 2 * nu) * c**2 * si**2) / s
    body = along_warp(cloth_grid(width, 0.2, columns, 17), [si, 0.0, -c])
    share = np.array([0.5, 1, 1, 1, 0.5])[:, None] / (columns - 1) * [0.0, 0.0, strain / compliance * width]
    forces = np.zeros_like(body.vertices)
    forces[:columns], forces[-columns:] = share, -share
    material = ClothMaterial(0.15, s, poisson_ratio=nu, damping_time=0.01, weft_stretch_ratio=ratio)
    with opened(scene(body, material, gravity=np.zeros(3))) as world:
        moved = run(world, 1.5, forces=forces, brake=10.0) - body.vertices
    inside = slice(4 * columns, -4 * columns)
    stretch = np.polyfit(body.vertices[inside, 2], moved[inside, 2], 1)[0]
    # Saint Venant-Kirchhoff: force = E t w e (1 + e) (1 + e/2).
    assert stretch * (1 + stretch) * (1 + stretch / 2) == pytest.approx(strain, rel=0.01)


def test_isotropic_forms_are_those_of_mujocos_own_compiler():
    mujoco = pytest.importorskip("mujoco")
    body = cloth_grid(0.3, 0.2, 3, 3)
    points = " ".join(str(x) for x in body.vertices.ravel())
    elements = " ".join(str(i) for i in body.elements.ravel())
    own = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option integrator="discrete"/><worldbody>
        <flexcomp name="a" type="direct" dim="2" mass="1" radius="0.001" point="{points}" element="{elements}">
        <contact selfcollide="none"/><elasticity young="1000" poisson="0.3" thickness="0.01" elastic2d="both"/>
        </flexcomp></worldbody></mujoco>"""
    )
    forms = stretch_forms(body, ClothMaterial(stretch_stiffness=10.0, poisson_ratio=0.3))
    np.testing.assert_allclose(own.flex_stiffness, forms.ravel(), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("kind", sorted(OBJECTS))
def test_a_factor_four_is_a_material_four_times_as_stiff(kind):
    body, material = OBJECTS[kind]
    name = "youngs_modulus" if kind == "solid" else "stretch_stiffness"
    stiff = with_fields(material, {name: 4.0 * getattr(material, name)})
    held, factor, paths = np.array([0, 1]), np.full(len(body.elements), 4.0), []
    for m, f in ((material, factor), (stiff, None), (material, None)):
        with opened(scene(body, m, held=held)) as world:
            for _ in range(60):
                world.step(body.vertices[held], None, f)
            paths.append(world.state().positions.copy())
    np.testing.assert_allclose(paths[0], paths[1], atol=1e-9)
    assert np.abs(paths[0] - paths[2]).max() > 1e-4


@pytest.mark.parametrize("kind", sorted(OBJECTS))
def test_a_factor_ends_with_its_step(kind):
    """Nothing moves while a factor acts at rest; afterwards the run is the plain one, bit for bit."""
    body, material = OBJECTS[kind]
    paths = []
    for factor in (np.full(len(body.elements), 3.0), None):
        with opened(scene(body, material, gravity=np.zeros(3))) as world:
            world.step(NOWHERE, None, factor)
            push = np.zeros_like(body.vertices)
            push[0, 0] = -1e-3
            paths.append(run(world, 0.1, forces=push).copy())
    np.testing.assert_array_equal(*paths)


def test_one_soft_segment_of_a_hanging_rope_gives_way_alone():
    """Its strain is the weight below over a hundredth of E A, to 1 %; the others stay as they were."""
    body, material = OBJECTS["rope"]
    factor = np.ones(len(body.elements))
    factor[1] = 0.01
    with opened(scene(body, material, held=np.array([0]), gravity=np.array([9.8, 0.0, 0.0]))) as world:
        for _ in range(200):
            world.step(body.vertices[:1], -8.0 * world.masses[:, None] * world.state().velocities, factor)
        strain = body.edge_lengths(world.state().positions) / body.edge_lengths(body.vertices) - 1.0
        below = 9.8 * world.masses[2:].sum()
    soft = strain[1] * (1 + strain[1]) * (1 + strain[1] / 2)
    assert soft == pytest.approx(below / (0.01 * material.stretch_stiffness), rel=0.01)
    assert np.delete(strain, 1).max() < 1.5e-4


def test_a_factor_that_is_not_finite_fails_the_rollout():
    body, material = OBJECTS["cloth"]
    with opened(scene(body, material)) as world, pytest.raises(RolloutFailed, match="factor on the stiffness"):
        world.step(NOWHERE, None, np.full(len(body.elements), np.nan))
