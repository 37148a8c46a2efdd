"""Solids against closed forms."""

import numpy as np
import pytest

pytest.importorskip("pybullet")

from pybullet_scenes import GRAVITY, NOWHERE, WEIGHTLESS, opened, run, scene

from muslin.backends.pybullet.volume import Volume
from muslin.core.body import Body, solid_box
from muslin.core.material import SolidMaterial
from muslin.core.obstacles import Table

E, NU, L, H, RHO = 264e3, 0.3, 0.1, 0.03, 1070.0
AREA, INERTIA, SHEAR = H * H, H**4 / 12, E / 2 / (1 + NU)


def _beam(counts: tuple[int, int, int]) -> tuple[Body, np.ndarray, np.ndarray]:
    body = solid_box(np.zeros(3), np.array([L, H, H]), counts)
    x = body.vertices[:, 0]
    return body, np.flatnonzero(x < 1e-9), np.flatnonzero(x > L - 1e-9)


def _timoshenko(load: float) -> float:
    bend, shear = 1 / (E * INERTIA), 1 / (5 / 6 * SHEAR * AREA)
    own = RHO * AREA * -GRAVITY[2]
    return own * L**4 * bend / 8 + own * L**2 * shear / 2 + load * -GRAVITY[2] * (L**3 * bend / 3 + L * shear)


def _sag(body: Body, held: np.ndarray, tip: np.ndarray, load: float = 0.0) -> float:
    loads = np.zeros(len(body.vertices))
    loads[tip] = load / len(tip)
    material = SolidMaterial(density=RHO, youngs_modulus=E, poisson_ratio=NU, damping_time=2e-3)
    with opened(scene(body, material, held=held, loads=loads)) as world:
        moved = run(world, 0.3, body.vertices[held], brake=25.0) - body.vertices
    return float(-moved[tip, 2].mean() / _timoshenko(load))


@pytest.mark.parametrize(("counts", "load"), [((5, 2, 2), 0.0), ((5, 2, 2), 0.02), ((6, 3, 3), 0.0)])
def test_a_beam_of_boxes_sags_as_timoshenko_says(counts, load):
    """Whether one cell or two are in its height."""
    assert _sag(*_beam(counts), load) == pytest.approx(1.0, abs=0.08)


def test_a_beam_of_tetrahedra_is_too_stiff():
    """The same vertices without the knowledge that they are a grid: linear tetrahedra lock."""
    body, held, tip = _beam((5, 2, 2))
    assert 0.2 < _sag(Body("solid", body.vertices, body.elements), held, tip) < 0.5


@pytest.mark.parametrize("mode", ["bending", "torsion"])
def test_one_box_is_exact_in_bending_and_torsion(mode):
    """Energy of a cell under u = k (x z, 0, -x^2 / 2), anticlastic, and under a twist about x, to second order."""
    size = np.array([0.05, 0.04, 0.03])
    body = solid_box(-size / 2, size / 2, (2, 2, 2))
    x, y, z = body.vertices.T
    if mode == "bending":
        # The corners cannot follow the squares, but those are the same at all of them: a rigid motion.
        motion = np.stack([x * z, -NU * y * z, 0 * x], axis=1)
        expected = 0.5 * E * size[0] * size[1] * size[2] ** 3 / 12
    else:
        motion = np.stack([0 * x, -x * z, x * y], axis=1)
        expected = 0.5 * E / 2 / (1 + NU) * size[0] * (size[1] * size[2] ** 3 + size[2] * size[1] ** 3) / 12
    elasticity = Volume(body, SolidMaterial(density=RHO, youngs_modulus=E, poisson_ratio=NU))
    elasticity.forces(body.vertices)
    assert 0.5 * np.vdot(motion, elasticity.stiffness(motion)) == pytest.approx(expected, rel=1e-9)


def test_young_and_poisson():
    """Uniaxial tension of a block between free ends: Young's modulus and Poisson's ratio."""
    body = solid_box(np.zeros(3), np.array([0.02, 0.02, 0.02]), (2, 2, 2))
    material = SolidMaterial(density=RHO, youngs_modulus=E, poisson_ratio=NU, damping_time=5e-3)
    strain = 1e-3
    # Consistent nodal forces of a uniform traction on the two x faces.
    normal = np.zeros(8)
    for triangle in body.triangles:
        a, b, c = body.vertices[triangle]
        normal[triangle] += np.cross(b - a, c - a)[0] / 6
    forces = np.outer(E * strain * normal, [1.0, 0.0, 0.0])
    with opened(scene(body, material, gravity=WEIGHTLESS)) as world:
        positions = run(world, 0.25, forces=forces)
    affine = np.linalg.lstsq(np.column_stack([body.vertices, np.ones(8)]), positions, rcond=None)[0][:3]
    size = np.diag(0.5 * (affine + affine.T)) - 1
    assert size[0] == pytest.approx(strain, rel=0.005)
    assert size[1:] == pytest.approx([-NU * strain] * 2, rel=0.01)


def test_a_load_slows_the_vibration():
    """A heavy tip: the period follows from the sag that the load makes and from its mass."""
    body, held, tip = _beam((5, 2, 2))
    load = 0.3
    loads = np.zeros(len(body.vertices))
    loads[tip] = load / len(tip)
    material = SolidMaterial(density=RHO, youngs_modulus=E, poisson_ratio=NU)
    across = np.array([0.0, 0.0, 1.0])
    pull = 9.80665 * across
    sag = load * 9.80665 * (L**3 / (3 * E * INERTIA) + L / (5 / 6 * SHEAR * AREA))
    with opened(scene(body, material, held=held, loads=loads, gravity=pull / 20)) as world:  # small motion
        path = []
        for _ in range(200):
            world.step(body.vertices[held], None)
            path.append((world.state().positions[tip] @ across).mean())
    swing = np.array(path) - 0.5 * (np.max(path) + np.min(path))
    up = np.flatnonzero((swing[:-1] < 0) & (swing[1:] >= 0))
    crossings = up + swing[up] / (swing[up] - swing[up + 1])
    # Rayleigh: 33/140 of a beam's mass swings along with its tip.
    stiffness = load * 9.80665 / sag
    expected = 2 * np.pi * np.sqrt((load + 33 / 140 * RHO * AREA * L) / stiffness)
    assert np.diff(crossings).mean() * 0.005 == pytest.approx(expected, rel=0.04)


def test_block_rests_on_the_table_and_slides_only_on_a_steep_one():
    body = solid_box(np.array([-0.02, -0.02, 0.1]), np.array([0.02, 0.02, 0.14]), (3, 3, 3))
    slides = []
    for friction in (0.0, 0.5):
        gravity = np.array([0.3, 0.0, -1.0]) * 9.80665
        material = SolidMaterial(friction=friction, damping_time=1e-3)
        with opened(scene(body, material, gravity=gravity, obstacles=(Table(0.1),))) as world:
            moved = run(world, 0.25, NOWHERE) - body.vertices
            slides.append((world.masses @ moved)[0] / world.masses.sum())
        assert np.abs(moved[body.vertices[:, 2] < 0.101, 2]).max() < 1e-3
    assert slides[0] == pytest.approx(0.5 * 0.3 * 9.80665 * 0.25**2, rel=0.05)
    assert abs(slides[1]) < 0.1 * slides[0]
