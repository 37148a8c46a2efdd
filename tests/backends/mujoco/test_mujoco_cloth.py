"""Cloth against plates and pendulums."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_scenes import G, opened, run, scene, swing

from muslin.core.body import Body, cloth_grid
from muslin.core.material import ClothMaterial


@pytest.mark.parametrize("poisson", [0.1, 0.4])
def test_tensile_strip(poisson):
    """1 % of strain, to 1.5 %."""
    columns, rows, width, length, strain = 5, 13, 0.05, 0.15, 0.01
    body = cloth_grid(width, length, columns, rows)
    top, bottom, middle = np.arange(columns), np.arange(-columns, 0), columns * (rows // 2)
    share = np.array([0.5, 1, 1, 1, 0.5]) / (columns - 1)
    forces = np.zeros_like(body.vertices)
    forces[bottom, 2] = -300.0 * width * strain * share
    material = ClothMaterial(stretch_stiffness=300.0, poisson_ratio=poisson, damping_time=0.01)
    with opened(scene(body, material, held=top, gravity=np.zeros(3))) as world:
        moved = run(world, 1.0, body.vertices[top], forces, brake=10.0) - body.vertices
    stretch = -moved[bottom, 2].mean() / length
    narrowing = (moved[middle, 0] - moved[middle + columns - 1, 0]) / width
    # Saint Venant-Kirchhoff: force = E t w e (1 + e) (1 + e/2).
    assert stretch * (1 + stretch) * (1 + stretch / 2) == pytest.approx(strain, rel=0.015)
    assert narrowing / stretch == pytest.approx(poisson, rel=0.03)


def test_bending_rigidity_matters_and_zero_of_it_is_a_membrane():
    """A strip held flat at one end hangs the lower the softer it is; without rigidity straight down."""
    body = cloth_grid(0.025, 0.1, 2, 5)
    flat = Body("cloth", body.vertices[:, [0, 2, 1]], body.elements, body.grid)
    held = np.arange(4)
    sags = []
    for rigidity in (1e-2, 1e-4, 0.0):
        with opened(scene(flat, ClothMaterial(bending_rigidity=rigidity), held=held)) as world:
            sags.append(float(-run(world, 1.5, flat.vertices[held], brake=8.0)[-2:, 2].mean()))
    assert sags == sorted(sags)
    assert sags[0] < 2e-3
    assert sags[2] == pytest.approx(0.075, rel=0.05)


@pytest.mark.parametrize("time_step", [0.002, 0.004])
def test_a_swinging_strip_loses_a_fifth_at_most_of_what_implicit_euler_takes(time_step):
    """That would be h w^2 / 2: the theta method takes a 19th of it, and terms that MuJoCo leaves out the rest."""
    body = cloth_grid(0.04, 0.2, 2, 6)
    cos, sin = np.cos(0.1), np.sin(0.1)
    turned = body.vertices @ np.array([[1, 0, 0], [0, cos, sin], [0, -sin, cos]])
    material = ClothMaterial(stretch_stiffness=3000.0, bending_rigidity=1e-2)
    held = np.array([0, 1])
    path = []
    with opened(scene(Body("cloth", turned, body.elements), material, held=held), time_step=time_step) as world:
        for _ in range(round(4.0 / time_step)):
            world.step(turned[held], None)
            path.append(world.state().positions[-2:, 1].mean())
    frequency, rate = swing(time_step, np.array(path))
    assert frequency == pytest.approx(np.sqrt(1.5 * G / 0.2), rel=0.02)
    assert 0.0 < rate < 0.2 * time_step * frequency**2 / 2
