"""Objects, scenes and rollouts shared by the tests of effects."""

import importlib.metadata
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from muslin.core.body import Body, cloth_grid, solid_box
from muslin.core.effect import Effect, NodalForce
from muslin.core.material import ClothMaterial, Material, SolidMaterial
from muslin.core.motion import Motion
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.scenario import STANDARD_GRAVITY, Scenario
from muslin.core.scene import Scene
from muslin.core.simulator import Simulator

G = STANDARD_GRAVITY
SHEET = cloth_grid(0.2, 0.1, 5, 4)
BLOCK = solid_box(np.zeros(3), np.array([0.1, 0.2, 0.3]), (3, 3, 3))
#: For hypothesis: the same cases every time, however busy the machine.
cases = settings(max_examples=60, deadline=None, derandomize=True)
EFFECTS = ("actuator-lag", "air-drag", "gravity-tilt", "internal-damping", "viscous-damping", "wind")


def engine(name: str = "mujoco", **options: Any) -> Simulator:
    """An engine by name, or a skipped test."""
    try:
        importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        pytest.skip(f"{name} is not installed")
    made: Simulator = REGISTRY.get("simulator", name)(**options)
    return made


def bound(effect: Effect, body: Body) -> NodalForce:
    """The nodal force of an effect on a body of the default material."""
    material = ClothMaterial() if body.kind == "cloth" else SolidMaterial()
    nothing = np.zeros(0, np.int64)
    scene = Scene(body, material, np.array([0.0, 0.0, -G]), nothing, np.zeros(len(body.vertices)))
    force = effect.bind(scene, body.vertex_measures * material.density)
    assert force is not None
    return force


def moving(body: Body, velocity: Any) -> np.ndarray:
    return np.tile(np.asarray(velocity, float), (len(body.vertices), 1))


def vertices(body: Body, material: Material, times: Any, *effects: Effect, grasps: Any = (), **more: Any) -> np.ndarray:
    """Where a body in its own pose goes ``(T, V, 3)`` [m] on MuJoCo."""
    step = more.pop("time_step", 0.005)
    task = Scenario(
        name="test",
        body=body,
        grasps=tuple(np.asarray(g) for g in grasps),
        motion=Motion.still(),
        times=np.asarray(times, float),
        markers=np.eye(len(body.vertices)),
        load_vertices=np.zeros(0, np.int64),
        **more,
    )
    return rollout(engine(time_step=step), task, material, effects).vertices
