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


def extremes(time_step: float, path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of the turning points of a sampled oscillation, by parabolas through three samples."""
    turn = np.flatnonzero(np.diff(path[:-1]) * np.diff(path[1:]) < 0) + 1
    a, b, c = path[turn - 1], path[turn], path[turn + 1]
    offset = 0.5 * (a - c) / (a - 2 * b + c)
    return time_step * (turn + offset), b - 0.25 * (a - c) * offset


def frequency_and_decay(time_step: float, path: np.ndarray) -> tuple[float, float]:
    """Angular frequency [rad/s] and rate of decay [1/s] of a sampled damped oscillation about any level."""
    when, what = extremes(time_step, path)
    swings = np.abs(np.diff(what))
    rate = -np.polyfit(0.5 * (when[1:] + when[:-1]), np.log(swings), 1)[0]
    return float(np.pi / np.median(np.diff(when))), float(rate)
