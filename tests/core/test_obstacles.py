"""Signed distances of obstacles, against closed forms."""

import numpy as np
import pytest

from muslin.core.errors import InputError
from muslin.core.obstacles import Cylinder, Obstacle, StaticMesh, Table

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) - 0.5
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
FACES = np.array([t for a, b, c, d in SIDES for t in ([a, b, c], [a, c, d])])


def cube() -> StaticMesh:
    return StaticMesh(CUBE, FACES)


def test_a_table() -> None:
    distance, normal = Table(0.2).signed_distance(np.array([[1.0, 2.0, 0.5], [0, 0, 0.1]]))
    np.testing.assert_allclose(distance, [0.3, -0.1])
    assert (normal == [0, 0, 1]).all()


@pytest.mark.parametrize(
    ("point", "distance", "normal"),
    [
        ((0, 0.1, 2.0), 1.0, (0, 0, 1)),
        ((0.6, 0, 0), -0.4, (1, 0, 0)),
        ((0, 1.9, 0), -0.1, (0, 1, 0)),
        ((0, -3.0, 0), 1.0, (0, -1, 0)),
        ((0, 2.3, 1.4), 0.5, (0, 0.6, 0.8)),
    ],
)
def test_a_cylinder(point: tuple[float, ...], distance: float, normal: tuple[float, ...]) -> None:
    lying = Cylinder(np.zeros(3), np.array([0, 3.0, 0]), 1.0, 4.0)
    d, n = lying.signed_distance(np.array([point], float))
    assert d[0] == pytest.approx(distance)
    np.testing.assert_allclose(n[0], normal, atol=1e-12)


def test_a_cube_as_a_mesh() -> None:
    assert cube().volume == pytest.approx(1.0)
    points = np.random.default_rng(0).uniform(-1, 1, (200, 3))
    away = np.abs(points) - 0.5
    outside = np.linalg.norm(np.maximum(away, 0), axis=1)
    expected = np.where(outside > 0, outside, away.max(axis=1))
    distance, normal = cube().signed_distance(points)
    np.testing.assert_allclose(distance, expected, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0)
    ahead, _ = cube().signed_distance(points + 1e-6 * normal)
    np.testing.assert_allclose((ahead - distance) / 1e-6, 1.0, atol=1e-3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Table(float("nan")), "not finite"),
        (lambda: Table(0.0, -1.0), "friction must be finite and not negative"),
        (lambda: Cylinder(np.zeros(3), np.zeros(3), 1.0, 1.0), "an axis that is not zero"),
        (lambda: Cylinder(np.zeros(3), np.ones(3), 0.0, 1.0), "positive radius"),
        (lambda: StaticMesh(CUBE, FACES[1:]), "must be closed, but 3 of its edges"),
        (lambda: StaticMesh(CUBE, FACES[:, ::-1]), "look outward"),
        (lambda: StaticMesh(CUBE, FACES + 1), "triangles between its 8 vertices"),
    ],
)
def test_obstacles_that_cannot_be(make: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        made: Obstacle = make()  # type: ignore[operator]
        assert made
