"""The shared effect loop: one rollout of any simulator with any effects."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .arrays import FloatArray
from .effect import Effect
from .errors import RolloutFailed
from .interpolation import interpolate
from .material import Material
from .scenario import STANDARD_GRAVITY, Scenario
from .series import PointSeries
from .simulator import Simulator

#: An edge longer than this times its rest length means that the rollout blew up without saying so.
LARGEST_STRETCH = 3.0
#: Rate of the artificial damping while an object comes to rest before the first observation [1/s].
SETTLE_RATE = 8.0
#: Step at which an effect may resample a command [s].
COMMAND_STEP = 0.002
_CHECK_EVERY = 10


@dataclass(frozen=True, eq=False)
class Trajectory:
    """What one rollout gave.

    Args:
        series: the observed markers.
        vertices: ``(T, V, 3)`` [m] at the observation times.
        poses: gripper poses really made ``(T, G, 7)``.
    """

    series: PointSeries
    vertices: FloatArray
    poses: FloatArray


def rollout(
    simulator: Simulator,
    scenario: Scenario,
    material: Material,
    effects: Sequence[Effect] = (),
    scale: float = 1.0,
) -> Trajectory:
    """Simulate ``scenario`` once.

    Effects that are off are left out altogether, so a coefficient of zero gives the plain trajectory
    bit for bit. The object starts where the grippers really are, after what effects make of their
    command. Observations between two steps are interpolated linearly.

    Raises:
        RolloutFailed: the engine failed, a position is not finite, or an edge is stretched beyond
            :data:`LARGEST_STRETCH`.
    """
    active = [e for e in effects if not e.is_off]
    gravity = np.array([0.0, 0.0, -STANDARD_GRAVITY])
    for effect in active:
        material, gravity = effect.on_material(material), effect.on_gravity(gravity)
        scenario = replace(scenario, motion=effect.on_command(scenario.motion, COMMAND_STEP))
    scene = scenario.scene(material, gravity, scale)
    simulator.check(scene)
    world = simulator.open(scene)
    try:
        dt = world.time_step
        forces = [f for f in (e.bind(scene, world.masses) for e in active) if f is not None]
        settle_steps = int(np.ceil(scenario.settle / dt - 1e-9))
        start, end = scenario.times[0], scenario.times[-1]
        steps = int(np.ceil((end - start) / dt - 1e-9))
        clock = start + dt * np.arange(-settle_steps, steps + 1)
        held = scenario.held_positions(np.maximum(clock, start), scene.body.vertices)
        rest = scene.body.edge_lengths(scene.body.vertices)
        path = np.empty((steps + 1, len(scene.body.vertices), 3))
        for k, time in enumerate(clock):
            state = world.state()
            if k >= settle_steps:
                path[k - settle_steps] = state.positions
            if k % _CHECK_EVERY == 0 or k == len(clock) - 1:
                _check(scene.body.edge_lengths(state.positions), rest, time)
            if k == len(clock) - 1:
                break
            total: FloatArray | None = None
            for force in forces:
                f = force(float(time), state.positions, state.velocities)
                total = f if total is None else total + f
            if k < settle_steps:
                brake = -SETTLE_RATE * world.masses[:, None] * state.velocities
                total = brake if total is None else total + brake
            world.step(held[k + 1], total)
    finally:
        world.close()
    vertices = interpolate(scenario.times, clock[settle_steps:], path)
    points = np.einsum("mv,tva->tma", scenario.markers, vertices)
    return Trajectory(PointSeries(scenario.times, points), vertices, scenario.motion.at(scenario.times))


def _check(lengths: FloatArray, rest: FloatArray, time: float) -> None:
    worst = float(np.max(lengths / rest))
    if not np.isfinite(worst):
        raise RolloutFailed(f"positions are not finite at {time:.3f} s")
    if worst > LARGEST_STRETCH:
        raise RolloutFailed(f"an edge is stretched {worst:.1f} times at {time:.3f} s")
