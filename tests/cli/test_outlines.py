"""Obstacles as lines."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from muslin.cli.report.outlines import outlines
from muslin.core.obstacles import Cylinder, StaticMesh, Table

LOW, HIGH = np.array([-1.0, 0.0, 0.0]), np.array([1.0, 1.0, 1.0])


def test_a_table_reaches_a_little_beyond_the_object() -> None:
    (line,) = outlines((Table(0.3),), LOW, HIGH)
    assert (line[:, 2] == 0.3).all() and line[0].tolist() == line[-1].tolist()
    np.testing.assert_allclose([line.min(axis=0)[:2], line.max(axis=0)[:2]], [[-1.2, -0.2], [1.2, 1.2]])


def test_a_cylinder_is_drawn_on_its_surface() -> None:
    spool = Cylinder(np.array([0.1, 0.2, 0.3]), np.array([1.0, 1.0, 0.0]), 0.2, 0.5)
    lines = outlines((spool,), LOW, HIGH)
    assert len(lines) == 10
    for line in lines:
        np.testing.assert_allclose(spool.signed_distance(line)[0], 0.0, atol=1e-12)


def test_of_a_cube_the_twelve_edges_are_drawn_and_not_the_diagonals() -> None:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([t for a, b, c, d in sides for t in ([a, b, c], [a, c, d])])
    lines = outlines((StaticMesh(corners, faces),), LOW, HIGH)
    assert len(lines) == 12
    assert {float(np.linalg.norm(line[1] - line[0])) for line in lines} == {1.0}
