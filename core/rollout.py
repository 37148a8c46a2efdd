"""The shared effect loop: one rollout of any simulator with any effects."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from .arrays import FloatArray
from .clamps import clamp_turns
from .effect import Effect
from .errors import InputError, RolloutFailed
from .first_frame import really_starting
from .interpolation import interpolate
from .material import Material, RopeMaterial
from .motion import IDENTITY_POSE, Motion, inverse, rotate, turned
from .rest_shape import eased
from .sanity import SanityCheck
from .scenario import STANDARD_GRAVITY, Scenario, StartMotion
from .scenarios.starts import GivenShape
from .series import PointSeries
from .simulator import CAPABILITIES, Simulator

#: Rate of the artificial damping while an object comes to rest before the first observation [1/s].
SETTLE_RATE = 8.0
#: Step at which an effect may resample a command [s].
COMMAND_STEP = 0.002
_CHECK_EVERY = 10
#: Turns of a gripper about a rope that are not worth telling an engine [rad]: a millionth of a whole one.
_NO_TURN = 6e-6


@dataclass(frozen=True, eq=False)
class Trajectory:
    """What one rollout gave.

    Args:
        series: the observed markers.
        vertices: ``(T, V, 3)`` [m] when they were seen, in the world, before what effects make of points.
        poses: gripper poses really made ``(T, G, 7)`` at the observation times.
        seconds: that the computation took [s].
    """

    series: PointSeries
    vertices: FloatArray
    poses: FloatArray
    seconds: float = 0.0


def rollout(
    simulator: Simulator,
    scenario: Scenario,
    material: Material,
    effects: Sequence[Effect] = (),
    scale: float = 1.0,
    time_limit: float | None = None,
) -> Trajectory:
    """Simulate ``scenario`` once.

    Effects that are off are left out altogether, so a coefficient of zero gives the plain trajectory
    bit for bit. The object starts where the grippers really are, after what effects make of their
    command. Observations between two steps are interpolated linearly.

    Args:
        simulator: that steps the world.
        scenario: what happens.
        material: of the object.
        effects: in any order; where several act on the same thing, one acts on what the other left.
        scale: of the object's size [1].
        time_limit: seconds of computation after which it is given up, or None.

    Raises:
        InputError: the simulator cannot build this, or cannot do what an effect needs.
        RolloutFailed: the engine failed, it took too long, or the state makes no sense
            (:class:`~muslin.core.sanity.SanityCheck`).
    """
    started = time.monotonic()
    deadline = np.inf if time_limit is None else started + time_limit
    active = [e for e in effects if not e.is_off]
    gravity = np.array([0.0, 0.0, -STANDARD_GRAVITY])
    told, stamps = scenario.motion, scenario.times
    for effect in active:
        _check_needs(effect, simulator)
        material, gravity = effect.on_material(material), effect.on_gravity(gravity)
        scenario = replace(scenario, motion=effect.on_command(scenario.motion, COMMAND_STEP))
    seen = reduce(lambda times, effect: effect.on_clock(times), active, stamps)
    scenario = really_starting(scenario, told, seen, active)
    start = scenario.times[0]
    seen = np.maximum(seen, start)  # what starts at rest was so before
    relaxed = reduce(lambda left, effect: effect.relaxed(left), active, material)
    for effect in active:
        scenario = replace(scenario, body=effect.on_body(scenario, relaxed, gravity))
    if isinstance(material, RopeMaterial) and isinstance(relaxed, RopeMaterial) and relaxed != material:
        scenario = _eased(scenario, relaxed.bending_rigidity / material.bending_rigidity)
    askew = reduce(lambda turn, effect: effect.on_obstacles(turn), active, IDENTITY_POSE[3:])
    is_askew = not np.array_equal(askew, IDENTITY_POSE[3:])
    if is_askew:  # engines know level obstacles only, so all else is turned until they are
        level = inverse(askew)
        gravity = rotate(level, gravity)
        scenario = _turned(scenario, level)
    scene = scenario.scene(material, gravity, scale)
    own = scenario.body.scaled(scale, np.zeros(3))
    for effect in active:
        scene = replace(scene, loads=effect.on_loads(own, material, scene.loads))
    simulator.check(scene)
    world = simulator.open(scene)
    try:
        dt = world.time_step
        forces = [f for f in (e.bind(scene, world.masses) for e in active) if f is not None]
        factors = [f for f in (e.bind_stiffness(scene) for e in active) if f is not None]
        shifts = [f for f in (e.bind_grasp(scene, world.masses) for e in active) if f is not None]
        settle_steps = int(np.ceil(scenario.settle / dt - 1e-9))
        end = max(stamps[-1], seen.max())
        steps = int(np.ceil((end - start) / dt - 1e-9))
        clock = start + dt * np.arange(-settle_steps, steps + 1)
        held = scenario.held_positions(np.maximum(clock, start), scene.start_positions)
        rolls: FloatArray | None = None
        if "twist" in simulator.capabilities:
            rolls = clamp_turns(scene.body, scene.grasps, scenario.motion.at(np.maximum(clock, start))[..., 3:], held)
            rolls = rolls if np.abs(rolls).max(initial=0.0) > _NO_TURN else None
        sane = SanityCheck(scene)
        brake = -SETTLE_RATE * world.masses[:, None]
        path = np.empty((steps + 1, len(scene.body.vertices), 3))
        for k, now in enumerate(clock.tolist()):
            state = world.state()
            if k >= settle_steps:
                path[k - settle_steps] = state.positions
            if k % _CHECK_EVERY == 0 or k == len(clock) - 1:
                sane(state.positions, now)
            if time.monotonic() > deadline:  # a step may take seconds
                where = f"had come to {now:.3f} s" if now >= start else "was still settling before the first frame"
                raise RolloutFailed(f"took longer than {time_limit:g} s, and {where}")
            if k == len(clock) - 1:
                break
            total: FloatArray | None = None
            for force in forces:
                f = force(now, state)
                total = f if total is None else total + f
            if k < settle_steps:
                slow = brake * state.velocities
                total = slow if total is None else total + slow
            stiffness: FloatArray | None = None
            for factor in factors:
                s = factor(now, state)
                stiffness = s if stiffness is None else stiffness * s
            target = held[k + 1]
            for shift in shifts:
                target = shift(now, state, target)
            more: dict[str, FloatArray] = {} if stiffness is None else {"stiffness": stiffness}
            if rolls is not None:
                more["turns"] = rolls[k + 1]
            world.step(target, total, **more)
    finally:
        world.close()
    vertices = interpolate(seen, clock[settle_steps:], path)
    poses, then = scenario.motion.at(stamps), scenario.motion.at(seen)
    if is_askew:
        vertices, poses, then = rotate(askew, vertices), turned(askew, poses), turned(askew, then)
    points: FloatArray = scenario.markers @ vertices
    if scenario.beside is not None:
        points = points + scenario.beside.shifts(vertices, then, scenario.markers)
    for effect in active:
        points = effect.on_points(points)
    return Trajectory(PointSeries(stamps, points), vertices, poses, time.monotonic() - started)


def _turned(scenario: Scenario, turn: FloatArray) -> Scenario:
    """The same, turned as a whole about the origin by a quaternion ``(4,)``, but for its obstacles."""
    earlier = None if scenario.earlier is None else rotate(turn, scenario.earlier)
    moving = scenario.start_motion
    if moving is not None:
        moving = StartMotion(rotate(turn, moving.velocities), rotate(turn, moving.accelerations))
    motion = Motion(scenario.motion.times, turned(turn, scenario.motion.poses))
    return replace(scenario, motion=motion, earlier=earlier, start_motion=moving)


def _eased(scenario: Scenario, share: float) -> Scenario:
    """The same with a rope of which the rest shape is bent by ``share`` of what it was; it starts as before."""
    body = scenario.body
    if (bent := eased(body, share)) is body:
        return scenario
    about = body.vertices[scenario.grasps[0]].mean(axis=0) if scenario.grasps else body.vertices.mean(axis=0)
    start = scenario.start or GivenShape(body.vertices, float(body.measures.sum()), about)
    return replace(scenario, body=bent, start=start)


def _check_needs(effect: Effect, simulator: Simulator) -> None:
    for need in sorted(effect.needs - simulator.capabilities):
        what = CAPABILITIES.get(need, repr(need))
        raise InputError(f"effect {effect.name!r} needs a simulator that can {what}, but {simulator.name!r} cannot")
