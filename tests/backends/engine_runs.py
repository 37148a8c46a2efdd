"""Scenarios and closed forms shared by the tests of both engines."""

import importlib.metadata
from typing import Any

import numpy as np
import pytest

from muslin.core.body import Body
from muslin.core.motion import Motion
from muslin.core.registry import REGISTRY
from muslin.core.scenario import STANDARD_GRAVITY, Scenario
from muslin.core.simulator import Simulator

ENGINES = ("mujoco", "pybullet")
G = STANDARD_GRAVITY


def simulator(engine: str, **options: Any) -> Simulator:
    """An engine by name, or a skipped test.

    Asks for the distribution: with this folder on the path, a folder of tests can pass for a missing engine.
    """
    try:
        importlib.metadata.version(engine)
    except importlib.metadata.PackageNotFoundError:
        pytest.skip(f"{engine} is not installed")
    made: Simulator = REGISTRY.get("simulator", engine)(**options)
    return made


def turned(about_x: float, height: float = 1.0) -> Motion:
    """A gripper that stays at ``height`` [m], turned about x [rad]."""
    half = 0.5 * about_x
    return Motion(np.zeros(1), np.array([[[0.0, 0.0, height, np.cos(half), np.sin(half), 0.0, 0.0]]]))


def scenario(body: Body, motion: Motion, times: Any, grasps: tuple[Any, ...] = (), **more: Any) -> Scenario:
    """Every vertex a marker."""
    return Scenario(
        name="test",
        body=body,
        grasps=tuple(np.asarray(g) for g in grasps),
        motion=motion,
        times=np.asarray(times, float),
        markers=np.eye(len(body.vertices)),
        load_vertices=np.zeros(0, np.int64),
        **more,
    )


def rising_zeros(time_step: float, path: np.ndarray) -> np.ndarray:
    """Times at which a sampled oscillation about zero passes it upwards."""
    up = np.flatnonzero((path[:-1] < 0) & (path[1:] >= 0))
    return time_step * (up + path[up] / (path[up] - path[up + 1]))
