from collections import Counter

import numpy as np
import pytest

from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.errors import InputError


def box() -> Body:
    return solid_box(np.array([0.1, -0.2, 0.3]), np.array([0.4, 0.2, 0.5]), (3, 4, 2))


def test_cloth_area_and_vertex_shares() -> None:
    cloth = cloth_grid(0.3, 0.2, 5, 4)
    assert cloth.measures.sum() == pytest.approx(0.06, rel=1e-12)
    assert cloth.vertex_measures.sum() == pytest.approx(0.06, rel=1e-12)
    assert (cloth.vertex_measures > 0).all()
    assert cloth.vertices[0].tolist() == pytest.approx([-0.15, 0.0, 0.0])
    assert cloth.vertices[-1].tolist() == pytest.approx([0.15, 0.0, -0.2])


def test_box_volume_and_orientation() -> None:
    solid = box()
    assert solid.measures.sum() == pytest.approx(0.3 * 0.4 * 0.2, rel=1e-12)
    assert solid.vertex_measures.sum() == pytest.approx(solid.measures.sum(), rel=1e-12)
    corners = solid.vertices[solid.elements]
    assert (np.linalg.det(corners[:, 1:] - corners[:, :1]) > 0).all()


def test_surface_of_a_box_is_closed_and_points_outward() -> None:
    solid = box()
    directed = Counter((int(a), int(b)) for f in solid.triangles for a, b in ((f[0], f[1]), (f[1], f[2]), (f[2], f[0])))
    assert set(directed.values()) == {1}
    assert all((b, a) in directed for a, b in directed)
    p = solid.vertices[solid.triangles]
    # the divergence theorem: a closed outward surface encloses the positive volume
    enclosed = np.einsum("fi,fi->", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6.0
    assert enclosed == pytest.approx(solid.measures.sum(), rel=1e-9)


def test_edges_are_unique_and_scale() -> None:
    cloth = cloth_grid(0.2, 0.2, 3, 3)
    assert len(cloth.edges) == 12 + 4
    twice = cloth.scaled(2.0, cloth.vertices[0])
    assert twice.vertices[0].tolist() == cloth.vertices[0].tolist()
    np.testing.assert_allclose(twice.edge_lengths(twice.vertices), 2 * cloth.edge_lengths(cloth.vertices))


@pytest.mark.parametrize(
    ("kind", "vertices", "elements", "words"),
    [
        ("cloth", np.zeros((3, 3)), np.array([[0, 1, 2, 2]]), "3 vertices"),
        ("solid", np.zeros((4, 3)), np.array([[0, 1, 2]]), "4 vertices"),
        ("cloth", np.zeros((3, 3)), np.array([[0, 1, 7]]), "vertex 7"),
        ("cloth", np.full((3, 3), np.nan), np.array([[0, 1, 2]]), "not finite"),
        ("rope", np.zeros((3, 3)), np.array([[0, 1, 2]]), "2 vertices"),
        ("rope", np.zeros((3, 3)), np.array([[0, 1]]), "one open chain"),
        ("rope", np.zeros((3, 3)), np.array([[1, 0], [1, 2]]), "one open chain"),
    ],
)
def test_meshes_that_cannot_be(kind: str, vertices: np.ndarray, elements: np.ndarray, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Body(kind, vertices, elements)  # type: ignore[arg-type]


def test_grids_too_coarse() -> None:
    with pytest.raises(InputError, match="2 x 2"):
        cloth_grid(1, 1, 1, 5)
    with pytest.raises(InputError, match="at least 2"):
        solid_box(np.zeros(3), np.ones(3), (2, 2, 1))


def test_a_rope_is_cut_into_equal_lengths() -> None:
    rope = rope_line(np.array([[0.0, 0, 0], [0.3, 0, 0], [0.3, 0.4, 0]]), 8)
    assert rope.elements.tolist() == [[k, k + 1] for k in range(7)]
    np.testing.assert_allclose(rope.vertices[3], [0.3, 0.0, 0.0], atol=1e-12)
    assert rope.measures.sum() == pytest.approx(0.7, rel=1e-12)
    np.testing.assert_allclose(rope.vertex_measures, [0.05, *[0.1] * 6, 0.05], rtol=1e-9)
    assert rope.triangles.shape == (0, 3)
    with pytest.raises(InputError, match="needs a length"):
        rope_line(np.zeros((2, 3)), 4)
    with pytest.raises(InputError, match="at least 2 vertices"):
        rope_line(np.eye(3), 1)


def test_warp_threads_follow_the_cloth() -> None:
    """Down the columns at first; turned, scaled and on a folded half with whatever carries it."""
    cloth = cloth_grid(0.2, 0.3, 4, 5)
    np.testing.assert_allclose(cloth.warp_directions(cloth.vertices), np.tile([0, 0, 1.0], (24, 1)), atol=1e-12)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turned = cloth.warp_directions(3.0 * cloth.vertices @ turn.T + 5.0)
    np.testing.assert_allclose(turned, np.tile(turn[:, 2], (24, 1)), atol=1e-12)
    bent = cloth.vertices.copy()
    low = bent[:, 2] < -0.15 - 1e-9
    bent[low] = np.stack([bent[low, 0], -0.15 - bent[low, 2], np.full(low.sum(), -0.15)], axis=1)
    along = cloth.warp_directions(bent)
    np.testing.assert_allclose(np.abs(along[-6:]), np.tile([0, 1.0, 0], (6, 1)), atol=1e-12)
