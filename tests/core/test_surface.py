"""Triangles to draw: closed, outward, as large as the thing itself, and textured upright."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.core.arrays import FloatArray, IntArray
from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.material import ClothMaterial, RopeMaterial, SolidMaterial
from muslin.core.obstacles import Cylinder, StaticMesh
from muslin.core.scene import Scene
from muslin.core.surface import Surface, object_surface, obstacle_surface, texture_coordinates


def surface(body: Body, diameter: float = 0.02) -> Surface:
    material = {"cloth": ClothMaterial(), "rope": RopeMaterial(diameter=diameter), "solid": SolidMaterial()}[body.kind]
    return object_surface(Scene(body, material, np.zeros(3), (), np.zeros(len(body.vertices))))


def volume(points: FloatArray, triangles: IntArray) -> float:
    """Enclosed by a closed surface [m3]; positive if its triangles look outward (divergence theorem)."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0)


def test_a_rope_is_a_closed_tube_of_its_diameter() -> None:
    body = rope_line(np.array([[1.0, 2.0, 3.0], [1.4, 2.3, 3.0]]), 12)
    drawn = surface(body)
    assert volume(drawn.place(body.vertices), drawn.triangles) == pytest.approx(np.pi * 0.01**2 * 0.5, rel=1e-6)


def test_a_bent_rope_is_not_twisted_and_stays_as_thick() -> None:
    t = np.linspace(0, 1, 80)
    helix = np.stack([0.1 * np.cos(9 * t), 0.1 * np.sin(9 * t), 0.2 * t], axis=1)
    body = rope_line(helix, 80)
    drawn = surface(body)
    points = drawn.place(body.vertices)
    length = np.linalg.norm(np.diff(body.vertices, axis=0), axis=1).sum()
    assert volume(points, drawn.triangles) == pytest.approx(np.pi * 0.01**2 * length, rel=0.02)
    rings = points[: 80 * 13].reshape(80, 13, 3) - body.vertices[:, None]
    assert (np.sum(rings[1:, 0] * rings[:-1, 0], axis=1) > 0.95 * 0.01**2).all(), "the seam runs around the rope"


def test_normals_of_a_rope_point_away_from_its_middle_also_at_the_seam() -> None:
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.3]]), 6)
    drawn = surface(body)
    points = drawn.place(body.vertices)
    wall = slice(13, 13 * 5)  # all rings but the first and the last
    outward = points[wall] * [1, 1, 0]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    assert np.sum(drawn.normals(points)[wall] * outward, axis=1).min() > 0.99


def test_vertices_that_coincide_do_not_break_a_rope() -> None:
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]), 5)
    drawn = surface(body)
    for crushed in (np.zeros((5, 3)), body.vertices * [[1], [1], [0], [1], [1]]):
        assert np.isfinite(drawn.normals(drawn.place(crushed))).all()


def test_a_sheet_has_two_sides_with_opposite_normals() -> None:
    body = cloth_grid(0.2, 0.1, 3, 3)
    drawn = surface(body)
    normals = drawn.normals(drawn.place(body.vertices))
    assert np.allclose(normals[:9], -normals[9:]) and np.allclose(np.abs(normals), [0, 1, 0])


def test_a_solid_is_its_skin() -> None:
    body = solid_box(np.zeros(3), np.array([0.1, 0.2, 0.3]), (3, 4, 3))
    drawn = surface(body)
    assert volume(drawn.place(body.vertices), drawn.triangles) == pytest.approx(0.006)


def test_obstacles_are_closed_and_as_large_as_they_are() -> None:
    drawn = obstacle_surface(Cylinder(np.array([1.0, 2, 3]), np.array([1.0, 1, 0]), 0.1, 0.5))
    points = drawn.place(np.zeros((0, 3)))
    assert volume(points, drawn.triangles) == pytest.approx(np.pi * 0.01 * 0.5, rel=2e-3)
    box = solid_box(np.zeros(3), np.ones(3), (2, 2, 2))
    mesh = obstacle_surface(StaticMesh(box.vertices, box.triangles))
    assert volume(mesh.place(np.zeros((0, 3))), mesh.triangles) == pytest.approx(1.0)
    normals = mesh.normals(mesh.place(np.zeros((0, 3))))
    assert np.allclose(np.abs(normals).max(axis=1), 1.0), "the faces of a box are flat up to its edges"


def test_a_texture_lies_upright_with_and_without_a_grid() -> None:
    body = cloth_grid(0.4, 0.2, 5, 3)
    uv = texture_coordinates(body)
    x, z = body.vertices[:, 0], body.vertices[:, 2]
    assert np.allclose(uv, np.stack([x / 0.4 + 0.5, -z / 0.2], axis=1))
    assert np.allclose(texture_coordinates(replace(body, grid=None)), uv)


def test_a_texture_covers_a_sheet_that_lies_flat_and_a_solid() -> None:
    flat = cloth_grid(0.3, 0.2, 4, 4)
    lying = Body("cloth", flat.vertices[:, [0, 2, 1]], flat.elements)
    cube = solid_box(np.zeros(3), np.full(3, 0.1), (3, 3, 3))
    for body in (lying, cube, Body("solid", cube.vertices[:, [2, 0, 1]], cube.elements)):
        uv = texture_coordinates(body)
        assert np.allclose(uv.min(axis=0), 0) and np.allclose(uv.max(axis=0), 1)
