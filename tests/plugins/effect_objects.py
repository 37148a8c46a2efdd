"""Objects, scenes and rollouts shared by the tests of effects."""

import importlib.metadata
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from muslin.core.arrays import FloatArray
from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.effect import Effect
from muslin.core.material import MATERIALS, Material
from muslin.core.motion import Motion
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.scenario import STANDARD_GRAVITY, Scenario
from muslin.core.scene import Scene
from muslin.core.simulator import Simulator, State
from muslin.core.testing.reference import ReferenceSimulator

G = STANDARD_GRAVITY
SHEET = cloth_grid(0.2, 0.1, 5, 4)
LYING = Body("cloth", SHEET.vertices[:, [0, 2, 1]], SHEET.elements, SHEET.grid)
BLOCK = solid_box(np.zeros(3), np.array([0.1, 0.2, 0.3]), (3, 3, 3))
ROPE = rope_line(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), 11)
#: For hypothesis: the same cases every time, however busy the machine.
cases = settings(max_examples=60, derandomize=True)
#: The effects that muslin ships.
EFFECTS = sorted(
    entry.name
    for entry in importlib.metadata.entry_points(group="muslin.effects")
    if entry.value.startswith("muslin.plugins.")
)


def engine(name: str = "mujoco", **options: Any) -> Simulator:
    """An engine by name, or a skipped test."""
    if name == "reference":
        return ReferenceSimulator()
    try:
        importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        pytest.skip(f"{name} is not installed")
    made: Simulator = REGISTRY.get("simulator", name)(**options)
    return made


def scene_of(body: Body, material: Material | None = None, gravity: Any = (0.0, 0.0, -G), obstacles: Any = ()) -> Scene:
    """A body that nobody holds, of the default material."""
    loads = np.zeros(len(body.vertices))
    return Scene(body, material or MATERIALS[body.kind](), np.array(gravity, float), (), loads, tuple(obstacles))


def bound(effect: Effect, body: Body) -> Callable[[float, FloatArray, FloatArray], FloatArray]:
    """The nodal force of an effect on a free body of the default material, of time, positions and velocities."""
    scene = scene_of(body)
    force = effect.bind(scene, body.vertex_measures * scene.material.density)
    assert force is not None
    return lambda time, positions, velocities: force(time, State(positions, velocities))


@dataclass(frozen=True)
class Run:
    """What a free object did: times ``(T,)``, positions and velocities ``(T, V, 3)``, masses ``(V,)``."""

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    masses: np.ndarray

    @property
    def mean_velocity(self) -> np.ndarray:
        """Of the centre of mass ``(T, 3)`` [m/s]."""
        return np.einsum("v,tvx->tx", self.masses, self.velocities) / self.masses.sum()


def play(name: str, scene: Scene, duration: float, *effects: Effect, push: Any = None, lie: float = 0.0) -> Run:
    """Step a free object, as a rollout would.

    Args:
        push: velocities given in one step at the start ``(V, 3)`` [m/s].
        lie: how long before it lies still on what is under it, with damping and without a slope [s].
    """
    material = scene.material
    for effect in effects:
        material = effect.on_material(material)
    scene = replace(scene, material=material)
    for effect in effects:
        scene = replace(scene, loads=effect.on_loads(scene.body, material, scene.loads))
    world = engine(name).open(scene)
    try:
        masses, step = world.masses.copy(), world.time_step
        forces = [f for f in (e.bind(scene, masses) for e in effects) if f is not None]
        seen = []
        first = -round(lie / step)
        for k in range(first, round(duration / step) + 1):
            state = world.state()
            if k >= 0:
                seen.append((k * step, state.positions.copy(), state.velocities.copy()))
            total = np.zeros_like(state.positions)
            for force in forces:
                total += force(k * step, state)
            if k < 0:
                total -= masses[:, None] * (20.0 * state.velocities + scene.gravity * [1.0, 1.0, 0.0])
            if k == 0 and push is not None:
                total += masses[:, None] * np.asarray(push) / step
            world.step(np.zeros((0, 3)), total)
    finally:
        world.close()
    times, positions, velocities = (np.array(a) for a in zip(*seen, strict=True))
    return Run(times, positions, velocities, masses)


def moving(body: Body, velocity: Any) -> np.ndarray:
    return np.tile(np.asarray(velocity, float), (len(body.vertices), 1))


def vertices(body: Body, material: Material, times: Any, *effects: Effect, grasps: Any = (), **more: Any) -> np.ndarray:
    """Where a body in its own pose goes ``(T, V, 3)`` [m] on MuJoCo."""
    step = more.pop("time_step", 0.005)
    task = Scenario(
        name="test",
        body=body,
        grasps=tuple(np.asarray(g) for g in grasps),
        motion=more.pop("motion", Motion.still()),
        times=np.asarray(times, float),
        markers=np.eye(len(body.vertices)),
        load_vertices=np.zeros(0, np.int64),
        **more,
    )
    return rollout(engine(time_step=step), task, material, effects).vertices
