"""The conformance kit of simulators."""

import itertools
from collections.abc import Callable
from functools import partial
from typing import ClassVar

import numpy as np

from ..arrays import FloatArray
from ..effect import Effect, NodalForce
from ..errors import InputError
from ..obstacles import Table
from ..parameters import Parameter
from ..rollout import rollout
from ..scenario import STANDARD_GRAVITY
from ..scene import Scene
from ..simulator import CAPABILITIES, Simulator, World
from .checks import Check, check_leaves_random_state, check_pickles, must, must_raise, raise_failures
from .samples import KINDS, sample_material, sample_scenario, sample_scene

MakeSimulator = Callable[[], Simulator]

#: How long the kit lets an object fall [s].
FALL = 0.2
#: Positions are exact to this where nothing has to be integrated [m].
EXACT = 1e-6


def check_simulator(make: MakeSimulator) -> None:
    """Hold a simulator against everything that muslin relies on.

    Args:
        make: builds the simulator; its class, if all options have defaults.

    Raises:
        AssertionError: lists every broken promise.
    """
    raise_failures("the simulator", simulator_checks(make))


def simulator_checks(make: MakeSimulator) -> list[Check]:
    """The checks of :func:`check_simulator`, one a promise and kind of body."""
    checks = [Check("declares its name, kinds and engine version", partial(check_declares, make))]
    claimed = [k for k in KINDS if k in make().object_kinds]
    for kind in claimed:
        for title, check in _PER_KIND.items():
            checks.append(Check(f"{kind}: {title}", partial(check, make, kind)))
    for kind in set(KINDS) - set(claimed):
        checks.append(Check(f"{kind}: refused, as it is not claimed", partial(check_refuses, make, kind)))
    return checks


def check_declares(make: MakeSimulator) -> None:
    """Name, kinds and engine version say something."""
    simulator = make()
    must(isinstance(simulator, Simulator), f"{type(simulator).__name__} is not a muslin.core Simulator")
    must(simulator.name and isinstance(simulator.name, str), "name must be a text")
    unknown = set(simulator.capabilities) - set(CAPABILITIES)
    must(not unknown, f"capabilities must be some of {tuple(CAPABILITIES)}, not {sorted(unknown)}")
    wrong = set(simulator.object_kinds) - set(KINDS)
    must(simulator.object_kinds and not wrong, f"object_kinds must be some of {KINDS}, not {simulator.object_kinds}")
    must(simulator.engine_version().strip(), "engine_version() must name the engine and its version")


def check_refuses(make: MakeSimulator, kind: str) -> None:
    """A kind of body that is not claimed is refused before anything is built."""
    must_raise(
        InputError,
        lambda: make().check(sample_scene(kind)),
        f"check() lets a {kind} pass, which is not in object_kinds",
    )


def check_start(make: MakeSimulator, kind: str) -> None:
    """The world starts as the scene says: positions, at rest, masses with loads."""
    scene = sample_scene(kind, load=0.02)
    count = len(scene.body.vertices)

    def look(world: World) -> None:
        state = world.state()
        for name, array in (("positions", state.positions), ("velocities", state.velocities)):
            must(array.shape == (count, 3), f"{name} have shape {array.shape}, not {(count, 3)}")
            must(np.isfinite(array).all(), f"{name} are not finite")
        worst = np.abs(state.positions - scene.body.vertices).max()
        must(
            worst < EXACT, f"a vertex starts {worst:.2g} m from where the scene has it; is the order that of the body?"
        )
        must(not state.velocities.any(), "the object moves at the start; it must be at rest")
        must(world.time_step > 0, f"time_step is {world.time_step}, but must be positive [s]")
        must(world.masses.shape == (count,), f"masses have shape {world.masses.shape}, not {(count,)}")
        must((world.masses > 0).all(), "a vertex has no mass")
        wanted = scene.body.measures.sum() * scene.material.density + 0.02
        total = world.masses.sum()
        must(
            abs(total / wanted - 1) < 1e-3, f"the masses add up to {total:.5g} kg, material and load to {wanted:.5g} kg"
        )
        must(world.masses[-1] > 0.02, "the load of the last vertex is not in its mass")

    _with_world(make(), scene, look)


def check_held(make: MakeSimulator, kind: str) -> None:
    """Held vertices are where they must be after every step, to rounding, and nothing becomes infinite."""
    scene = sample_scene(kind, held=True)

    def look(world: World) -> None:
        for k in range(30):
            target = scene.body.vertices[scene.held] + 0.3 * world.time_step * (k + 1) * np.array([0.5, 1.0, 0.2])
            world.step(target, None)
            state = world.state()
            worst = np.abs(state.positions[scene.held] - target).max()
            must(worst < 1e-9, f"a held vertex is {worst:.2g} m off its command after step {k + 1}; it must be exact")
            must(np.isfinite(state.positions).all(), f"positions are not finite after step {k + 1}")
            must(np.isfinite(state.velocities).all(), f"velocities are not finite after step {k + 1}")

    _with_world(make(), scene, look)


def check_free_fall(make: MakeSimulator, kind: str) -> None:
    """Free, the object falls along gravity as g t^2 / 2, but for what a first-order integrator may miss."""
    gravity = np.array([0.7, -0.4, -STANDARD_GRAVITY])
    _accelerates(make(), sample_scene(kind, gravity=gravity), gravity, None)


def check_nodal_force(make: MakeSimulator, kind: str) -> None:
    """Nodal forces m a move the object as a t^2 / 2, gravity off."""
    pull = np.array([1.5, -2.0, 0.5])
    _accelerates(make(), sample_scene(kind, gravity=np.zeros(3)), pull, pull)


def check_balance(make: MakeSimulator, kind: str) -> None:
    """Nodal forces -m g hold the object still in the air."""
    scene = sample_scene(kind, load=0.005)
    _accelerates(make(), scene, np.zeros(3), -scene.gravity)


def check_force_ends(make: MakeSimulator, kind: str) -> None:
    """A force acts in the step that it is given for, and not in the next."""

    def look(world: World) -> None:
        nothing = np.zeros((0, 3))
        world.step(nothing, world.masses[:, None] * np.array([2.0, 0.0, 0.0]))
        before = world.state().velocities.copy()
        for _ in range(5):
            world.step(nothing, None)
        change = np.abs(world.state().velocities - before).max()
        must(change < EXACT, f"velocity still changes by {change:.2g} m/s after the force has ended")

    _with_world(make(), sample_scene(kind, gravity=np.zeros(3)), look)


def check_table(make: MakeSimulator, kind: str) -> None:
    """The object falls onto a table, reaches it and ends on it or above it, to within 1 cm.

    While it lands it may go deeper, by the way that it falls in two steps: no engine can stop what it
    has not seen touch yet.
    """
    scene = sample_scene(kind, obstacles=(Table(0.85),))

    def look(world: World) -> None:
        lowest, fastest = np.inf, 0.0
        for _ in range(int(np.ceil(0.5 / world.time_step))):
            world.step(np.zeros((0, 3)), None)
            state = world.state()
            lowest = min(lowest, float(state.positions[:, 2].min()))
            fastest = max(fastest, float(-state.velocities[:, 2].min()))
        deepest = 0.84 - 2 * fastest * world.time_step
        last = float(world.state().positions[:, 2].min())
        must(lowest > deepest, f"within 0.5 s a vertex gets to {lowest:.3f} m, below the table at 0.85 m")
        must(lowest < 0.86, f"within 0.5 s no vertex gets below {lowest:.3f} m, though the table is at 0.85 m")
        must(last > 0.84, f"after 0.5 s the lowest vertex is at {last:.3f} m, though the table is at 0.85 m")

    _with_world(make(), scene, look)


def check_repeats(make: MakeSimulator, kind: str) -> None:
    """The same rollout is the same bit for bit: again, in a copy from pickle, and beside another world."""
    simulator = make()
    first = _path(simulator, kind)
    must(np.array_equal(first, _path(simulator, kind)), "a second rollout differs from the first")
    copy = check_pickles(simulator, "the simulator")
    must(np.array_equal(first, _path(copy, kind)), "a pickled copy gives another trajectory")
    other = simulator.open(sample_scene(kind))
    try:
        other.step(np.zeros((0, 3)), None)
        beside = _path(simulator, kind)
    finally:
        other.close()
    must(np.array_equal(first, beside), "a rollout depends on another world that is open at the same time")


def check_zero_effect(make: MakeSimulator, kind: str) -> None:
    """An effect with coefficient zero leaves the trajectory bit for bit; with another it does not."""
    simulator = make()
    plain = _path(simulator, kind)
    must(np.array_equal(plain, _path(simulator, kind, SideForce(acceleration=0.0))), "an effect at zero changes it")
    moved = np.abs(plain - _path(simulator, kind, SideForce(acceleration=2.0))).max()
    must(moved > 1e-5, f"a nodal force of 2 m/s2 times mass moves nothing by more than {moved:.2g} m")


def check_random_state(make: MakeSimulator, kind: str) -> None:
    """The global random generators are left alone."""
    check_leaves_random_state(lambda: _path(make(), kind))


_PER_KIND: dict[str, Callable[[MakeSimulator, str], None]] = {
    "starts as the scene says": check_start,
    "held vertices are exact": check_held,
    "free fall": check_free_fall,
    "nodal forces accelerate": check_nodal_force,
    "nodal forces balance gravity": check_balance,
    "a force ends with its step": check_force_ends,
    "a table carries the object": check_table,
    "repeats bit for bit": check_repeats,
    "an effect at zero changes nothing": check_zero_effect,
    "global random state untouched": check_random_state,
}


class SideForce(Effect):
    """A uniform sideways pull, for the kit."""

    name: ClassVar[str] = "conformance-side-force"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = (Parameter("acceleration", "m/s2", 0.0, 5.0),)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        pull = masses[:, None] * np.array([self.values["acceleration"], 0.0, 0.0])
        return lambda time, state: pull


def _with_world(simulator: Simulator, scene: Scene, look: Callable[[World], None]) -> None:
    simulator.check(scene)
    world = simulator.open(scene)
    try:
        look(world)
    finally:
        world.close()


def _accelerates(simulator: Simulator, scene: Scene, expected: FloatArray, push: FloatArray | None) -> None:
    """Every vertex must move as ``expected (3,)`` [m/s2] says when pushed by ``push`` [m/s2] times mass."""

    def look(world: World) -> None:
        force = None if push is None else world.masses[:, None] * push
        steps = itertools.takewhile(lambda k: k * world.time_step < FALL, itertools.count())
        count = sum(1 for _ in steps)
        for _ in range(count):
            world.step(np.zeros((0, 3)), force)
        time, size = count * world.time_step, float(np.linalg.norm(expected))
        state = world.state()
        slip = np.abs(state.velocities - expected * time).max()
        must(slip < 1e-3 * size * time + EXACT, f"after {time:.3f} s a velocity is {slip:.2g} m/s off a t")
        apart = np.linalg.norm(state.positions - scene.body.vertices - 0.5 * expected * time**2, axis=1).max()
        allowed = 0.55 * size * time * world.time_step + EXACT  # half a step too early or too late
        must(
            apart < allowed, f"after {time:.3f} s a vertex is {apart:.2g} m off a t^2 / 2; {allowed:.2g} m are allowed"
        )

    _with_world(simulator, scene, look)


def _path(simulator: Simulator, kind: str, *effects: Effect) -> FloatArray:
    return rollout(simulator, sample_scenario(kind), sample_material(kind), effects).vertices
