"""What must be exact: free flight, nodal forces, momentum, held vertices, repeats."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pybullet")

from pybullet_scenes import GRAVITY, NOWHERE, SMALL_CLOTH, SMALL_ROPE, SMALL_SOLID, WEIGHTLESS, opened, run, scene

from muslin.core.material import ClothMaterial, RopeMaterial, SolidMaterial
from muslin.core.obstacles import Table

BODIES = [
    pytest.param(SMALL_CLOTH, ClothMaterial(damping_time=1e-3), id="cloth"),
    pytest.param(SMALL_ROPE, RopeMaterial(damping_time=1e-3), id="rope"),
    pytest.param(SMALL_SOLID, SolidMaterial(damping_time=1e-3), id="solid"),
]


@pytest.mark.parametrize(("body", "material"), BODIES)
def test_starts_at_rest_in_the_order_of_the_mesh(body, material):
    with opened(scene(body, material)) as world:
        np.testing.assert_array_equal(world.state().positions, body.vertices)
        np.testing.assert_array_equal(world.state().velocities, 0.0)
        assert world.masses == pytest.approx(body.vertex_measures * material.density)


@pytest.mark.parametrize(("body", "material"), BODIES)
@pytest.mark.parametrize("loaded", [False, True])
def test_free_fall_in_any_direction(body, material, loaded):
    gravity = np.array([1.0, -2.0, -9.0])
    loads = np.zeros(len(body.vertices))
    loads[-1] = 0.05 * loaded
    with opened(scene(body, material, gravity=gravity, loads=loads)) as world:
        fallen = run(world, 0.3) - body.vertices
        velocities = world.state().velocities
        substep = world.time_step / world._substeps
    np.testing.assert_allclose(velocities, np.tile(gravity * 0.3, (len(fallen), 1)), rtol=1e-7, atol=1e-8)
    # Symplectic Euler falls half a substep's worth further than the parabola.
    np.testing.assert_allclose(
        fallen, np.tile(gravity * 0.15 * (0.3 + substep), (len(fallen), 1)), rtol=1e-7, atol=1e-8
    )


@pytest.mark.parametrize(("body", "material"), BODIES)
def test_forces_in_proportion_to_mass_accelerate_rigidly(body, material):
    loads = np.linspace(0.0, 0.01, len(body.vertices))
    with opened(scene(body, material, gravity=WEIGHTLESS, loads=loads)) as world:
        run(world, 0.2, forces=world.masses[:, None] * np.array([0.0, 3.0, 1.0]))
        expected = np.tile([0.0, 0.6, 0.2], (len(loads), 1))
        np.testing.assert_allclose(world.state().velocities, expected, rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize(("body", "material"), BODIES)
def test_a_force_on_one_vertex_gives_its_whole_impulse(body, material):
    """Momentum, and so the inertia of loads, although Bullet takes all vertices for equally heavy."""
    loads = np.zeros(len(body.vertices))
    loads[-1] = 0.02
    forces = np.zeros((len(loads), 3))
    forces[-1] = [0.02, 0.03, 0.01]
    with opened(scene(body, material, gravity=WEIGHTLESS, loads=loads)) as world:
        run(world, 0.2, forces=forces)
        momentum = world.masses @ world.state().velocities
    # What damping leaves unsolved is the only leak.
    np.testing.assert_allclose(momentum, 0.2 * forces[-1], rtol=2e-3)


@pytest.mark.parametrize(("body", "material"), BODIES)
def test_held_vertices_are_exactly_where_they_should_be_and_pull_the_rest(body, material):
    held = np.array([0, 1])
    with opened(scene(body, material, held=held, gravity=WEIGHTLESS)) as world:
        for k in range(20):
            command = body.vertices[held] + np.array([0.0, 0.003 * (k + 1), 0.0])
            world.step(command, np.full((len(body.vertices), 3), 0.001))
            np.testing.assert_array_equal(world.state().positions[held], command)
        np.testing.assert_allclose(world.state().velocities[held], [[0.0, 0.6, 0.0]] * 2, atol=1e-12)
        moved = world.state().positions - body.vertices
    assert moved[:, 1].mean() > 0.01


def test_a_body_that_rested_long_still_answers():
    """Bullet puts quiet rigid bodies to sleep; these must not be."""
    with opened(scene(SMALL_CLOTH, ClothMaterial(), gravity=WEIGHTLESS)) as world:
        run(world, 3.0)
        run(world, 0.1, forces=world.masses[:, None] * GRAVITY)
        np.testing.assert_allclose(world.state().velocities[:, 2], 0.1 * GRAVITY[2], rtol=1e-7)


def _fingerprint() -> str:
    import hashlib

    digest = hashlib.sha256()
    for parameter in BODIES:
        body, material = parameter.values
        with opened(scene(body, material, held=np.array([0]), obstacles=(Table(-0.22),))) as world:
            digest.update(run(world, 0.15, body.vertices[:1]).tobytes())
    return digest.hexdigest()


def test_repeats_are_bit_identical_here_and_in_another_process():
    first = _fingerprint()
    assert first == _fingerprint()
    code = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); import {Path(__file__).stem} as t; "
    other = subprocess.run(
        [sys.executable, "-c", code + "print(t._fingerprint())"], capture_output=True, text=True, check=True, cwd="/"
    )
    assert other.stdout.split() == [first]


def test_worlds_live_side_by_side():
    with opened(scene(SMALL_CLOTH, ClothMaterial())) as one, opened(scene(SMALL_SOLID, SolidMaterial())) as other:
        for _ in range(5):
            one.step(NOWHERE, None)
            other.step(NOWHERE, None)
        assert one.state().velocities[:, 2] == pytest.approx(0.025 * GRAVITY[2])
        assert other.state().velocities[:, 2] == pytest.approx(0.025 * GRAVITY[2])
