"""The built-in scenarios on both engines, coarse: they do what their names say, and alike."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from engine_runs import ENGINES, simulator

from muslin.core.arrays import FloatArray
from muslin.core.motion import Motion
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.core.scenarios import preset

COUNTS = {"carry": (5, 5), "fold": (5, 5), "wiping": (4, 4), "cable": (21,), "winding": (31,)}
#: Root mean square distance between the engines over all vertices and times, at most [m].
APART = {"carry": 0.03, "fold": 0.03, "wiping": 0.003, "cable": 0.03, "winding": 0.06}

pytestmark = pytest.mark.slow


@cache
def made(name: str) -> Scenario:
    """Winding at double speed: most of its cost is time."""
    scenario = preset(name).scenario(vertices=COUNTS[name])
    if name != "winding":
        return scenario
    motion = Motion(scenario.motion.times / 2, scenario.motion.poses)
    return replace(scenario, motion=motion, times=scenario.times[scenario.times <= motion.times[-1]], settle=0.2)


@cache
def path(name: str, engine: str) -> FloatArray:
    return rollout(simulator(engine), made(name), preset(name).default_material()).vertices


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", COUNTS)
def test_nothing_is_stretched_or_sinks_in_and_what_is_held_is_held(name: str, engine: str) -> None:
    scenario, x = made(name), path(name, engine)
    body = scenario.body
    assert np.abs(body.edge_lengths(x) / body.edge_lengths(body.vertices) - 1).max() < 0.1
    for obstacle in scenario.obstacles:
        assert obstacle.signed_distance(x.reshape(-1, 3))[0].min() > -0.006
    held = np.concatenate(scenario.grasps)
    at = scenario.held_positions(scenario.times, scenario.start_vertices())
    np.testing.assert_allclose(x[:, held], at, atol=2e-4)  # interpolated between two steps


@pytest.mark.parametrize("engine", ENGINES)
def test_folded_cloth_is_half_as_long_and_lies(engine: str) -> None:
    end = path("fold", engine)[-1]
    assert np.ptp(end[:, 1]) < 0.6 * 0.3
    assert end[:, 2].max() < 0.06


@pytest.mark.parametrize("engine", ENGINES)
def test_a_wiping_cloth_follows_the_hand_flat(engine: str) -> None:
    x = path("wiping", engine)
    np.testing.assert_allclose((x[-1] - x[0]).mean(axis=0)[:2], [0.15, 0.21], atol=0.03)
    assert x[..., 2].max() < 0.02


@pytest.mark.parametrize("engine", ENGINES)
def test_a_cable_sags_deeper_when_its_ends_draw_nearer(engine: str) -> None:
    x = path("cable", engine)

    def sag(points: FloatArray) -> float:
        """Largest distance from the line between the ends, whichever way the cable swings."""
        along = (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])
        apart = points - points[0]
        return float(np.linalg.norm(apart - (apart @ along)[:, None] * along, axis=1).max())

    assert sag(x[-1]) > sag(x[0]) + 0.02
    assert np.ptp(x[:, 10, 1]) > 0.05  # and it swings


@pytest.mark.parametrize("engine", ENGINES)
def test_a_wound_rope_lies_round_the_spool(engine: str) -> None:
    x, spool = path("winding", engine), made("winding").obstacles[0]
    near = [int((spool.signed_distance(x[k])[0] < 0.012).sum()) for k in (0, -1)]
    link = 1.0 / 30
    assert near[0] * link < 0.6 * 2 * np.pi * 0.044
    assert near[1] * link > 1.2 * 2 * np.pi * 0.044


@pytest.mark.parametrize("name", COUNTS)
def test_both_engines_agree(name: str) -> None:
    apart = np.linalg.norm(path(name, "mujoco") - path(name, "pybullet"), axis=2)
    assert np.sqrt((apart**2).mean()) < APART[name]
