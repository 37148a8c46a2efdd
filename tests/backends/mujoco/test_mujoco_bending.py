"""Bending of cloth against the heavy elastica, on any mesh, in any direction, woven or not."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_scenes import HEAVY_ELASTICA, HEAVY_SAG, G, along_warp, droop, opened, scene, strip

from muslin.backends.mujoco.stencils import quadruples, spread
from muslin.core.body import Body
from muslin.core.errors import InputError
from muslin.core.material import ClothMaterial
from muslin.core.plate import bending_matrix

LENGTH = 0.1


def _heavy(rigidity: float, stretch_stiffness: float = 300.0, along: float = 1.0, **more: float) -> ClothMaterial:
    """A sheet as heavy as the elastica asks for, ``along`` being its rigidity along the strip over ``rigidity``."""
    density = HEAVY_ELASTICA * along * rigidity / (G * LENGTH**3)
    return ClothMaterial(density, stretch_stiffness, rigidity, **more)


def _unstructured(cells: int, width: float) -> Body:
    """The strip with its inner vertices moved by up to a quarter of a cell."""
    body, cell = strip(cells, width), LENGTH / cells
    vertices = body.vertices.copy()
    x, y = vertices[:, 0], np.abs(vertices[:, 1])
    inner = (x > 1e-9) & (x < LENGTH - 1e-9) & (y < y.max() - 1e-9)
    vertices[inner, :2] += np.random.default_rng(1).uniform(-0.25, 0.25, (inner.sum(), 2)) * cell
    return Body("cloth", vertices, body.elements)


def _one_diagonal(cells: int, width: float) -> Body:
    body = strip(cells, width)
    assert body.grid is not None
    index = np.arange(len(body.vertices)).reshape(body.grid)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]))
    return Body("cloth", body.vertices, np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)]))


@pytest.mark.parametrize("rigidity", [1e-6, 1e-3])
@pytest.mark.parametrize("stretch_stiffness", [10.0, 1e4])
def test_a_cantilever_sags_as_the_heavy_elastica(rigidity, stretch_stiffness):
    """To 6 % with 8 cells and 3 % with 16."""
    coarse, fine = (droop(strip(n, 0.025), _heavy(rigidity, stretch_stiffness)) / HEAVY_SAG for n in (8, 16))
    assert coarse == pytest.approx(1.0, abs=0.06)
    assert fine == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("width", [0.0125, 0.1])
def test_narrow_and_wide_strips_bend_alike(width):
    assert droop(strip(8, width), _heavy(2e-4)) == pytest.approx(droop(strip(8, 0.05), _heavy(2e-4)), rel=5e-3)


@pytest.mark.parametrize("mesh", [_unstructured, _one_diagonal])
def test_other_meshes_bend_alike(mesh):
    assert droop(mesh(8, 0.05), _heavy(2e-4)) / HEAVY_SAG == pytest.approx(1.0, abs=0.06)


@pytest.mark.slow
def test_a_fine_mesh_comes_within_one_percent():
    assert droop(strip(32, 0.00625), _heavy(2e-4)) / HEAVY_SAG == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(("angle", "along"), [(0.0, 0.5), (45.0, 0.5 * (0.5 * (0.5 + 2.0) + 1.0)), (90.0, 2.0)])
def test_a_woven_strip_bends_as_its_direction_says(angle, along):
    """Weft four times as stiff as warp: D/2 along the warp, 2 D along the weft, and bent at 45 degrees all three
    curvatures are half of the strip's: D (1/2 + 2 + 2) / 4, if it stays a cylinder, as a wide one does.
    """
    material = _heavy(2e-4, along=along, weft_bending_ratio=4.0)
    direction = [np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0]
    body = along_warp(strip(8, 0.15), direction)
    assert droop(body, material) / HEAVY_SAG == pytest.approx(1.0, abs=0.10)


def test_the_second_flex_carries_the_matrix():
    body = _unstructured(4, 0.05)
    matrix = bending_matrix(body, np.arange(3))
    sets = quadruples(matrix, body.vertices)
    total = np.zeros_like(matrix)
    np.add.at(total, (sets[:, :, None], sets[:, None, :]), spread(matrix, sets))
    np.testing.assert_allclose(total, matrix, atol=1e-12 * np.abs(matrix).max())


def test_force_of_a_small_deflection_is_the_matrix_times_it():
    """What MuJoCo's arrays really do, read off its passive forces."""
    mujoco = pytest.importorskip("mujoco")
    body, rigidity = _unstructured(6, 0.05), 3e-4
    lifted = np.random.default_rng(0).normal(size=len(body.vertices)) * 1e-7
    start = body.vertices + lifted[:, None] * [0.0, 0.0, 1.0]
    with opened(scene(body, ClothMaterial(bending_rigidity=rigidity), start=start, gravity=np.zeros(3))) as world:
        mujoco.mj_forward(world._model, world._data)
        force = np.array(world._data.qfrc_passive).reshape(-1, 3)[:, 2]
    expected = -rigidity * bending_matrix(body, np.zeros(0, np.int64)) @ lifted
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


def test_an_edge_with_three_triangles_is_refused_with_its_vertices():
    from muslin.backends.mujoco import MujocoSimulator

    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])
    fins = Body("cloth", points, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]))
    with pytest.raises(InputError, match="3 triangles meet in the edge between vertices 0 and 1"):
        MujocoSimulator().check(scene(fins, ClothMaterial()))


def test_a_triangle_without_area_is_refused_with_its_number():
    from muslin.backends.mujoco import MujocoSimulator

    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]])
    flat = Body("cloth", points, np.array([[0, 1, 2], [0, 1, 3]]))
    with pytest.raises(InputError, match="triangle 1 of the cloth has no area"):
        MujocoSimulator().check(scene(flat, ClothMaterial()))
