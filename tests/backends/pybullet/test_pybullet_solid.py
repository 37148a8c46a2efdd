"""Solids against closed forms."""

import numpy as np
import pytest

pytest.importorskip("pybullet")

from pybullet_scenes import GRAVITY, NOWHERE, WEIGHTLESS, opened, run, scene

from muslin.backends.pybullet.elements import Elements, volumetric
from muslin.core.body import Body, solid_box
from muslin.core.material import SolidMaterial
from muslin.core.obstacles import Table

E, NU, L, H, RHO = 264e3, 0.3, 0.1, 0.03, 1070.0
AREA, INERTIA, SHEAR = H * H, H**4 / 12, E / 2 / (1 + NU)


def _beam(counts: tuple[int, int, int]) -> tuple[Body, np.ndarray, np.ndarray]:
    body = solid_box(np.zeros(3), np.array([L, H, H]), counts)
    x = body.vertices[:, 0]
    return body, np.flatnonzero(x < 1e-9), np.flatnonzero(x > L - 1e-9)


def _linear_sag(body: Body, held: np.ndarray, loads: np.ndarray, gravity: np.ndarray = GRAVITY) -> np.ndarray:
    """Displacements ``(V, 3)`` of the same tetrahedra by small-strain statics."""
    elements = Elements(body, volumetric(E, NU))
    matrix = elements.strain_matrix(body.vertices)
    count = 3 * len(body.vertices)
    columns = [elements.stiffness(matrix, unit.reshape(-1, 3)).ravel() for unit in np.eye(count)]
    stiffness = np.stack(columns, axis=1)
    free = np.ones(count, dtype=bool)
    free[(3 * held[:, None] + np.arange(3)).ravel()] = False
    weight = ((body.vertex_measures * RHO + loads)[:, None] * gravity).ravel()
    out = np.zeros(count)
    out[free] = np.linalg.solve(stiffness[np.ix_(free, free)], weight[free])
    return out.reshape(-1, 3)


def _timoshenko(load: float) -> float:
    bend, shear = 1 / (E * INERTIA), 1 / (5 / 6 * SHEAR * AREA)
    own = RHO * AREA * -GRAVITY[2]
    return own * L**4 * bend / 8 + own * L**2 * shear / 2 + load * -GRAVITY[2] * (L**3 * bend / 3 + L * shear)


@pytest.mark.parametrize("load", [0.0, 0.02])
def test_beam_sag(load):
    """Equal to linear statics of its own mesh; against beam theory, coarse linear tetrahedra are too stiff."""
    body, held, tip = _beam((7, 3, 3))
    loads = np.zeros(len(body.vertices))
    loads[tip] = load / len(tip)
    material = SolidMaterial(density=RHO, youngs_modulus=E, poisson_ratio=NU, damping_time=2e-3)
    with opened(scene(body, material, held=held, loads=loads)) as world:
        moved = run(world, 0.4, body.vertices[held], brake=25.0) - body.vertices
    sag = -moved[tip, 2].mean()
    assert sag == pytest.approx(-_linear_sag(body, held, loads)[tip, 2].mean(), rel=0.02)
    assert 0.4 * _timoshenko(load) < sag < _timoshenko(load)


@pytest.mark.slow
def test_beam_sag_converges_to_timoshenko():
    ratios = []
    for counts in ((9, 4, 4), (13, 5, 5), (17, 6, 6)):
        body, held, tip = _beam(counts)
        ratios.append(-_linear_sag(body, held, np.zeros(len(body.vertices)))[tip, 2].mean() / _timoshenko(0.0))
    assert ratios == sorted(ratios)
    assert ratios[-1] > 0.8


def test_lame_constants_reach_bullet():
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
    # Along the diagonal of the section, a principal direction also of the mesh, whose cells are not symmetric.
    across = np.array([0.0, 1.0, 1.0]) / np.sqrt(2)
    pull = 9.80665 * across
    displacements = _linear_sag(body, held, loads, pull) - _linear_sag(body, held, 0 * loads, pull)
    sag = (displacements[tip] @ across).mean()
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
    assert np.diff(crossings).mean() * 0.005 == pytest.approx(expected, rel=0.03)


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
