"""Hems and wet patches: where their mass is."""

from dataclasses import replace

import numpy as np
import pytest
from effect_objects import LYING, ROPE, SHEET, cases, engine, vertices
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from muslin.core.body import Body, rope_line
from muslin.core.material import ClothMaterial, RopeMaterial
from muslin.core.motion import Motion
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.plugins.effects.mass import Hem, WetPatch, boundary_edges, share_below
from muslin.plugins.effects.observation import rotation_matrix

NOTHING = np.zeros(20)


def test_the_rim_of_a_grid_is_its_outline():
    x, _, z = SHEET.vertices[boundary_edges(SHEET)].mean(axis=1).T
    assert len(x) == 2 * (4 + 3)
    assert (np.isclose(np.abs(x), 0.1) | np.isclose(z, 0.0) | np.isclose(z, -0.1)).all()


def test_a_hem_weighs_its_length():
    loads = Hem(line_mass=0.01).on_loads(SHEET, ClothMaterial(), NOTHING + 0.001) - 0.001
    assert loads.sum() == pytest.approx(0.01 * 0.6)
    inside = (np.abs(SHEET.vertices[:, 0]) < 0.09) & (SHEET.vertices[:, 2] < -0.01) & (SHEET.vertices[:, 2] > -0.09)
    np.testing.assert_array_equal(loads[inside], 0.0)
    assert (loads[~inside] > 0).all()


def test_a_hole_has_a_hem_too():
    """Two triangles out of the middle: their four sides are rim."""
    middle = np.abs(SHEET.vertices[SHEET.elements].mean(axis=1) - [0.025, 0, -0.05]) < [0.025, 1, 0.0167]
    holed = Body("cloth", SHEET.vertices, SHEET.elements[~middle.all(axis=1)])
    assert len(holed.elements) == len(SHEET.elements) - 2
    assert len(boundary_edges(holed)) == len(boundary_edges(SHEET)) + 4


def test_what_is_closed_has_no_hem():
    corners = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    bag = Body("cloth", corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    np.testing.assert_array_equal(Hem(line_mass=0.01).on_loads(bag, ClothMaterial(), np.zeros(4)), 0.0)


@pytest.mark.parametrize("extent", [0.0, 0.2, 0.5, 0.77, 1.0])
@pytest.mark.parametrize(("body", "material"), [(SHEET, ClothMaterial()), (LYING, ClothMaterial())])
def test_water_is_the_uptake_of_the_wet_share(body, material, extent):
    loads = WetPatch(uptake=0.8, extent=extent).on_loads(body, material, NOTHING)
    assert loads.sum() == pytest.approx(0.8 * extent * material.areal_density * 0.02)
    axis = 2 if body is SHEET else 1
    far = body.vertices[:, axis] > body.vertices[:, axis].min() + extent * 0.1 + 0.1 / 3 + 1e-9
    np.testing.assert_array_equal(loads[far], 0.0)


@pytest.mark.parametrize("tilt", [1e-5, -0.03])
def test_a_sheet_that_a_real_gripper_holds_almost_level_is_wet_where_a_level_one_is(tilt):
    askew = replace(LYING, vertices=LYING.vertices @ rotation_matrix(np.array([0.0, tilt, 0.0])).T)
    wet = WetPatch(uptake=0.8, extent=0.4)
    level, tilted = (wet.on_loads(body, ClothMaterial(), NOTHING) for body in (LYING, askew))
    np.testing.assert_allclose(tilted, level, atol=1e-12)


@pytest.mark.parametrize("extent", [0.3, 1.0])
def test_a_rope_is_wet_from_its_lower_end(extent):
    hanging = rope_line(np.array([[0.0, 0, 0], [0.1, 0, -0.4]]), 9)
    loads = WetPatch(uptake=1.5, extent=extent).on_loads(hanging, RopeMaterial(), np.zeros(9))
    assert loads.sum() == pytest.approx(1.5 * extent * 0.05 * np.hypot(0.1, 0.4))
    assert loads[-1] > 0
    assert (loads[0] > 0) == (extent == 1.0)
    level = WetPatch(uptake=1.5, extent=extent).on_loads(ROPE, RopeMaterial(), np.zeros(11))
    assert level.sum() == pytest.approx(1.5 * extent * 0.05 * 0.5)


@cases
@given(hnp.arrays(np.float64, (1, 3), elements=st.integers(0, 8).map(float)), st.floats(-1.0, 9.0))
def test_share_below_a_level_is_the_area_under_it(heights, level):
    """Against counting points spread evenly over the triangle."""
    k = 60
    i, j = np.meshgrid(np.arange(k), np.arange(k))
    a, b = ((g.ravel() + 1 / 3) / k for g in (i, j))
    a, b = a[a + b < 1], b[a + b < 1]
    points = heights[0, 0] * a + heights[0, 1] * b + heights[0, 2] * (1 - a - b)
    if np.ptp(heights) > 0:
        assert share_below(heights, level)[0] == pytest.approx((points < level).mean(), abs=0.06)


def test_a_hem_and_a_wet_end_pull_a_soft_sheet_longer():
    """By the extra weight below each height over the stiffness: W / (S b) at the top, to first order."""
    soft = ClothMaterial(stretch_stiffness=20.0, damping_time=0.02, poisson_ratio=0.0, bending_rigidity=1e-4)
    held = (np.arange(5),)

    def length(*effects):
        hanging = vertices(SHEET, soft, [0.0, 0.01], *effects, grasps=held, settle=1.5)[0]
        return -hanging[15:, 2].mean()

    more = Hem(line_mass=0.02)
    loads = more.on_loads(SHEET, soft, NOTHING).reshape(4, 5)[::-1].sum(axis=1)
    below = np.cumsum(loads)[:3]  # what hangs on every row of triangles, from the lowest up
    expected = (below * 9.80665 / (20.0 * 0.2) * 0.1 / 3).sum()
    assert length(more) - length() == pytest.approx(expected, rel=0.1)
    wet = WetPatch(uptake=2.0, extent=0.5)
    assert length(wet) - length() > 0.2 * expected


@pytest.mark.parametrize("pitch", [0.15, -0.15])
def test_water_is_in_the_same_end_however_a_gripper_is_turned_at_first(pitch):
    """What is wet belongs to the object; its recordings start with grippers turned otherwise."""

    class Noted(WetPatch):
        def on_loads(self, body, material, loads):
            seen.append(super().on_loads(body, material, loads))
            return seen[-1]

    seen = []
    for angle in (0.0, pitch):
        pose = np.array([[[0.0, 0.0, 1.0, np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0]]])
        scenario = Scenario(
            "held", ROPE, (np.array([0]),), Motion(np.zeros(1), pose), np.array([0.0, 0.01]), np.eye(11),
            np.zeros(0, np.int64),
        )  # fmt: skip
        rollout(engine("reference"), scenario, RopeMaterial(), [Noted(uptake=1.0, extent=0.3)])
    np.testing.assert_allclose(seen[1], seen[0])
