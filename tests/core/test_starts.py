"""The shapes that ropes start in."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.core.errors import InputError
from muslin.core.material import RopeMaterial
from muslin.core.motion import Motion
from muslin.core.obstacles import Cylinder, Table
from muslin.core.scenarios import preset
from muslin.core.scenarios.starts import chain_along, hanging_chain

DOWN = np.array([0.0, 0.0, -9.8])


def links(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(points, axis=0), axis=1)


@pytest.mark.parametrize(
    "end", [(0.7, 0, 0), (0.3, -0.4, 0.2), (0.99, 0, 0.05), (0.06, 0, -0.3), (0.5, 0.5, 0.6), (0.05, 0, 0.9)]
)
def test_a_hanging_chain_has_the_right_length_and_ends_and_is_at_rest(end: tuple[float, float, float]) -> None:
    a, b = np.array([0.1, 0.2, 1.0]), np.array([0.1, 0.2, 1.0]) + end
    chain = hanging_chain(a, b, 41, 1.0 / 40)
    np.testing.assert_allclose(chain[[0, -1]], [a, b], atol=1e-12)
    np.testing.assert_allclose(links(chain), 1.0 / 40, rtol=1e-9)
    # at rest, the slope of the links rises by the same amount from one to the next: weight over horizontal tension
    step = np.diff(chain, axis=0)
    slope = step[:, 2] / np.hypot(step[:, 0], step[:, 1])
    np.testing.assert_allclose(np.diff(slope), np.diff(slope)[0], rtol=1e-4)
    assert np.diff(slope)[0] > 0


def test_a_fine_chain_is_the_catenary() -> None:
    parameter, half = 0.4, 0.35
    length = 2 * parameter * np.sinh(half / parameter)
    chain = hanging_chain(np.array([-half, 0, 0]), np.array([half, 0, 0]), 401, length / 400)
    np.testing.assert_allclose(
        chain[:, 2], parameter * (np.cosh(chain[:, 0] / parameter) - np.cosh(half / parameter)), atol=2e-5
    )


def test_a_taut_chain_is_straight_and_one_between_equal_points_hangs_double() -> None:
    taut = hanging_chain(np.zeros(3), np.array([1.02, 0, 0]), 11, 0.1)
    np.testing.assert_allclose(taut[:, 0], np.linspace(0, 1.02, 11))
    for count in (11, 12):
        loop = hanging_chain(np.zeros(3), np.zeros(3), count, 0.1)
        np.testing.assert_allclose(loop[[0, -1]], 0.0, atol=1e-12)
        np.testing.assert_allclose(links(loop), 0.1, rtol=0.12)
        assert loop[:, 2].min() == pytest.approx(-0.05 * (count - 1), rel=0.12)


def test_a_chain_keeps_to_its_curve_and_goes_on_beyond_it() -> None:
    angle = np.linspace(0, np.pi / 2, 500)
    curve = np.stack([np.sin(angle), np.zeros(500), np.cos(angle)], axis=1)
    chain = chain_along(curve, 30, 0.1)
    np.testing.assert_allclose(links(chain), 0.1, rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(chain[:15], axis=1), 1.0, atol=1e-5)
    assert chain[-1, 0] == pytest.approx(1.0, abs=5e-3) and chain[-1, 2] < -1.0


def test_a_cable_starts_between_its_grippers_wherever_they_are() -> None:
    scenario = preset("cable").scenario(size=[0.8], vertices=[21])
    poses = np.array([[[0.2, 0.1, 0.5, 0.6, 0.0, 0.8, 0.0], [0.5, -0.2, 0.7, 1, 0, 0, 0]]])
    scenario = replace(scenario, motion=Motion(np.zeros(1), poses))
    for scale in (1.0, 1.3):
        start = scenario.start_vertices(scale)
        np.testing.assert_allclose(start[[0, -1]], poses[0, :, :3], atol=1e-12)
        assert links(start).sum() == pytest.approx(0.8 * scale, rel=1e-9)
        held = scenario.held_positions(np.zeros(1), start)
        np.testing.assert_allclose(held[0], start[[0, 1, -2, -1]], atol=1e-12)


def test_a_cable_needs_two_grippers() -> None:
    scenario = preset("cable").scenario()
    one = replace(scenario, grasps=scenario.grasps[:1], motion=Motion.still())
    with pytest.raises(InputError, match="poses of both"):
        one.start_vertices()


def test_a_cable_leaves_a_gripper_along_its_turn() -> None:
    """Two vertices an end: what a gripper turns by, the first segment turns by."""
    scenario = preset("cable").scenario()
    still = scenario.motion.poses[0]
    turned = still.copy()
    turned[0, 3:] = [np.cos(0.3), 0.0, 0.0, np.sin(0.3)]  # by 0.6 about z
    scenario = replace(scenario, motion=Motion(np.array([0.0, 1.0]), np.stack([still, turned])))
    held = scenario.held_positions(np.array([0.0, 1.0]), scenario.start_vertices())
    before, after = held[:, 1] - held[:, 0]
    c, s = np.cos(0.6), np.sin(0.6)
    np.testing.assert_allclose(after, np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ before, atol=1e-12)


@pytest.mark.parametrize("ends", [((20, 19), (1, 0)), ((3,), (15,)), ((15,), (3,)), ((20,), (5, 4))])
def test_a_cable_is_held_by_the_vertices_that_its_grippers_hold(ends: tuple[tuple[int, ...], tuple[int, ...]]) -> None:
    """Whichever end is in the first gripper, and wherever along it they are; what is beyond hangs down."""
    scenario = preset("cable").scenario(size=[0.8], vertices=[21])
    poses = np.array([[[0.2, 0.1, 0.5, 1, 0, 0, 0], [0.4, -0.1, 0.6, 1, 0, 0, 0]]])
    scenario = replace(scenario, motion=Motion(np.zeros(1), poses), grasps=tuple(np.array(e) for e in ends))
    start = scenario.start_vertices()
    low, high = sorted((ends[0][0], min(ends[1]) if ends[1][0] < ends[0][0] else max(ends[1])))
    np.testing.assert_allclose(start[[ends[0][0], low + high - ends[0][0]]], poses[0, :, :3], atol=1e-12)
    np.testing.assert_allclose(links(start), 0.04, rtol=1e-9)
    for tail in (start[: low + 1], start[high:]):
        assert not np.ptp(tail[:, :2], axis=0).any()


@pytest.mark.parametrize(("grasp", "at"), [((50, 49), 50), ((5, 6), 5), ((44,), 44)])
def test_a_rope_is_wound_from_where_it_is_held(grasp: tuple[int, ...], at: int) -> None:
    scenario = replace(preset("winding").scenario(), grasps=(np.array(grasp),))
    start = scenario.start_vertices()
    np.testing.assert_allclose(start[at], scenario.motion.poses[0, 0, :3], atol=1e-12)
    np.testing.assert_allclose(links(start), 0.02, rtol=1e-9)
    assert start[0 if at > 25 else -1, 0] < -0.04  # the longer end hangs on the other side


@pytest.mark.parametrize("diameter", [0.002, 0.02])
def test_a_wound_rope_starts_on_the_spool(diameter: float) -> None:
    scenario = preset("winding").scenario()
    scene = scenario.scene(RopeMaterial(diameter=diameter), DOWN)
    spool, start = scenario.obstacles[0], scene.start_positions
    np.testing.assert_allclose(links(start), 0.02, rtol=1e-9)
    np.testing.assert_allclose(start[0], scenario.motion.poses[0, 0, :3], atol=1e-12)
    middles = 0.5 * (start[1:] + start[:-1])
    nearest = spool.signed_distance(middles)[0].min()
    assert nearest == pytest.approx(diameter / 2, abs=1e-5)
    assert start[-1, 2] < 0.7 and start[-1, 0] < -0.04  # the end hangs on the other side


def test_a_rope_that_cannot_be_wound() -> None:
    scenario = preset("winding").scenario()
    standing = Cylinder(np.array([0, 0, 1.0]), np.array([0, 0, 1.0]), 0.04, 0.2)
    around = Cylinder(np.array([0.5, 0, 1.0]), np.array([0, 1.0, 0]), 0.1, 0.2)
    for obstacle, words in ((Table(0.0), "there is none"), (standing, "that stands"), (around, "in or beside")):
        with pytest.raises(InputError, match=words):
            replace(scenario, obstacles=(obstacle,)).start_vertices()
