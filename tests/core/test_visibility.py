"""A point is seen in the picture and with nothing between; the renderers say the same, pixel by pixel."""

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.camera import Camera
from muslin.core.errors import InputError
from muslin.core.keypoints import keypoint_weights
from muslin.core.material import ClothMaterial, RopeMaterial, SolidMaterial
from muslin.core.obstacles import Cylinder, Obstacle, StaticMesh, Table
from muslin.core.renderer import find_renderer
from muslin.core.scene import Scene
from muslin.core.visibility import visible

#: From y = -1 m along y, x to the right.
CAMERA = Camera.look_at(np.array([0.0, -1.0, 0.0]), np.zeros(3))
SHEET = cloth_grid(0.2, 0.2, 5, 5)
MATERIALS = {"cloth": ClothMaterial(), "rope": RopeMaterial(diameter=0.02), "solid": SolidMaterial()}


def scene(body: Body, *obstacles: Obstacle) -> Scene:
    return Scene(body, MATERIALS[body.kind], np.zeros(3), (), np.zeros(len(body.vertices)), obstacles)


def seen(body: Body, points: list[list[float]], *obstacles: Obstacle, camera: Camera = CAMERA) -> list[bool]:
    vertices = body.vertices[None]
    return list(visible(scene(body, *obstacles), camera, vertices, np.array([points], float))[0])


def test_a_point_behind_the_cloth_or_a_spool_is_not_seen() -> None:
    sheet = Body("cloth", SHEET.vertices + [0.0, 0.0, 0.1], SHEET.elements)  # its middle at the origin
    points = [[0.0, 0.1, 0.0], [0.0, -0.1, 0.0], [0.05, 0.0, 0.05], [0.3, 0.1, 0.0], [5.0, 0.0, 0.0], [0.0, -2.0, 0.0]]
    spool = Cylinder(np.array([0.0, -0.3, 0.0]), np.array([0.0, 0.0, 1.0]), 0.02, 1.0)
    assert seen(sheet, points) == [False, True, True, True, False, False]
    assert seen(sheet, points, spool) == [False, False, True, True, False, False]


def test_a_solid_a_static_mesh_and_a_table_hide() -> None:
    block = solid_box(np.full(3, -0.05), np.full(3, 0.05), (3, 3, 3))
    assert seen(block, [[0.0, -0.05, 0.0], [0.0, 0.05, 0.0], [0.2, 0.0, 0.0]]) == [True, False, True]
    wall = StaticMesh(block.vertices + [0.2, -0.3, 0.0], block.triangles)
    assert seen(block, [[0.0, -0.05, 0.0], [0.28, 0.0, 0.0]], wall) == [True, False]
    high = Camera.look_at(np.array([0.0, -1.0, 0.5]), np.zeros(3))
    points = [[0.3, 0.0, 0.0], [0.3, 0.0, -0.013], [0.3, 0.0, -0.1]]
    assert seen(block, points, Table(-0.01), camera=high) == [True, True, False]
    low = Camera.look_at(np.array([0.0, -1.0, -0.5]), np.zeros(3))
    assert seen(block, points, Table(-0.01), camera=low) == [True, True, True]


def test_a_rope_hides_what_runs_behind_it_but_not_itself() -> None:
    loop = np.array([[-0.2, 0.0, 0.0], [0.2, 0.0, 0.0], [0.2, 0.1, 0.0], [0.0, 0.1, -0.2], [0.0, 0.1, 0.2]])
    rope = rope_line(loop, 41)
    points = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.1, 0.15]]
    assert seen(rope, points) == [True, True, False, True]


@pytest.mark.parametrize("kind", ["cloth", "solid"])
def test_what_is_seen_is_what_is_drawn_at_that_depth(kind: str) -> None:
    """At the pixel of a point that is seen the picture shows the object at the point's depth, else something nearer."""
    rng = np.random.default_rng(3)
    if kind == "cloth":
        body = cloth_grid(0.3, 0.3, 13, 13)
        vertices: FloatArray = body.vertices + [0.0, 0.0, 0.15]
        fold = np.abs(vertices[:, 0])
        vertices = np.stack([0.9 * fold, vertices[:, 0] * 0.4, vertices[:, 2]], axis=1)  # a V, seen from its side
    else:
        body = solid_box(np.full(3, -0.08), np.full(3, 0.08), (5, 5, 5))
        vertices = body.vertices
    camera = Camera.look_at(np.array([0.3, -1.0, 0.2]), np.zeros(3))
    rod = Cylinder(np.array([0.1, -0.4, 0.05]), np.array([1.0, 0.2, 0.0]), 0.02, 0.3)
    stage = scene(body, rod)
    corners = vertices[body.triangles]
    share = rng.dirichlet([2.0, 2.0, 2.0], len(corners))
    points = np.einsum("fk,fkx->fx", share, corners)
    found = visible(stage, camera, vertices[None], points[None])[0]
    assert 0.2 < found.mean() < 0.95
    with find_renderer("auto").open(stage) as view:
        depth = view.render(vertices, camera).depth
    pixels, apart = camera.project(points)
    column, row = np.rint(pixels).astype(int).T
    nearer = apart - depth[row, column]
    agree = found == (nearer < 0.012)
    assert agree.mean() > 0.97  # a point at an outline falls into a pixel of what is beside it


@pytest.mark.parametrize("count", [1, 4, 8])
def test_keypoints_are_the_same_spots_on_every_mesh(count: int) -> None:
    line = np.array([[0.0, 0.0, 0.0], [0.3, 0.4, 0.0]])
    pairs = [
        (cloth_grid(0.3, 0.2, 9, 5), cloth_grid(0.3, 0.2, 17, 9)),
        (rope_line(line, 11), rope_line(line, 51)),
    ]
    for one, other in pairs:
        a, b = (keypoint_weights(body, count) @ body.vertices for body in (one, other))
        np.testing.assert_allclose(a, b, atol=1e-12)
        assert len(np.unique(a.round(9), axis=0)) == count


def test_keypoints_of_a_block_lie_far_from_each_other() -> None:
    block = solid_box(np.zeros(3), np.array([0.1, 0.2, 0.3]), (3, 4, 5))
    found = keypoint_weights(block, 2) @ block.vertices
    np.testing.assert_allclose(np.abs(found[1] - found[0]), [0.1, 0.2, 0.3])
    eight = keypoint_weights(block, 8) @ block.vertices
    apart = np.linalg.norm(eight[:, None] - eight, axis=-1) + np.eye(8)
    assert apart.min() > 0.1  # of 60 vertices 5 to 7.5 cm apart


def test_more_keypoints_than_there_are_spots_are_refused() -> None:
    with pytest.raises(InputError, match="8 keypoints at most"):
        keypoint_weights(SHEET, 9)
    with pytest.raises(InputError, match="1 to 25 keypoints, not 0"):
        keypoint_weights(SHEET, 0)
