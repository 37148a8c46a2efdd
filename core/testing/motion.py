"""What every simulator owes: motion as mechanics says, held vertices exact, and the same again every time."""

import inspect
import itertools
from collections.abc import Callable
from typing import ClassVar

import numpy as np

from ..arrays import FloatArray
from ..effect import Effect, NodalForce
from ..parameters import Parameter
from ..rollout import rollout
from ..scenario import STANDARD_GRAVITY
from ..scene import Scene
from ..simulator import Simulator, World
from .checks import check_leaves_random_state, check_pickles, must
from .samples import sample_material, sample_scenario, sample_scene
from .worlds import EXACT, MakeSimulator, hanging, with_world

#: How long the kit lets an object fall [s].
FALL = 0.2
#: Differences between trajectories below this are not looked at [m].
SLIGHT = 5e-4


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

    with_world(make(), scene, look)


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

    with_world(make(), scene, look)


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
    """A force gives the impulse of the one step that it is given for; a scheme of several steps may take some to."""

    def look(world: World) -> None:
        nothing, pull = np.zeros((0, 3)), np.array([2.0, 0.0, 0.0])
        for _ in range(3):
            world.step(nothing, None)
        world.step(nothing, world.masses[:, None] * pull)
        for _ in range(20):
            world.step(nothing, None)
        before = world.state().velocities.copy()
        for _ in range(5):
            world.step(nothing, None)
        after = world.state().velocities
        change = np.abs(after - before).max()
        must(change < EXACT, f"velocity still changes by {change:.2g} m/s after the force has ended")
        given = np.abs(after - world.time_step * pull).max()
        must(given < EXACT, f"a force of one step leaves a velocity that is {given:.2g} m/s from acceleration x step")

    with_world(make(), sample_scene(kind, gravity=np.zeros(3)), look)


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


def check_stretch(make: MakeSimulator, kind: str) -> None:
    """Under its weight the object grows as Hooke's law says, to 5 %."""
    rig = hanging(kind)

    def look(world: World) -> None:
        share = rig.growth(world)
        must(abs(share - 1.0) < 0.05, f"hanging, it grows {share:.3f} times as much as its stiffness says")

    with_world(make(), rig.scene, look)


def check_refines(make: MakeSimulator, kind: str) -> None:
    """Halving the time step brings the trajectory nearer to the limit: at first order to a third."""
    if not takes_time_step(make):
        return
    step = _time_step(make(), sample_scene(kind))
    coarse, half, fine = (_path(make(time_step=step / k), kind) for k in (1, 2, 4))
    first, second = np.abs(coarse - fine).max(), np.abs(half - fine).max()
    must(
        second < max(0.55 * first, SLIGHT),
        f"a time step of {step:g} s is {1e3 * first:.2g} mm off one of {step / 4:g} s, and half of it still "
        f"{1e3 * second:.2g} mm",
    )
    opened = _time_step(make(time_step=step / 2), sample_scene(kind))
    must(np.isclose(opened, step / 2), f"with time_step = {step / 2:g} its worlds have a step of {opened:g} s")


def takes_time_step(make: MakeSimulator) -> bool:
    """Whether ``make`` has an option ``time_step``."""
    parameters = inspect.signature(make).parameters.values()
    return any(p.name == "time_step" or p.kind is p.VAR_KEYWORD for p in parameters)


def _time_step(simulator: Simulator, scene: Scene) -> float:
    world = simulator.open(scene)
    try:
        return world.time_step
    finally:
        world.close()


class SideForce(Effect):
    """A uniform sideways pull, for the kit."""

    name: ClassVar[str] = "conformance-side-force"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = (Parameter("acceleration", "m/s2", 0.0, 5.0),)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        pull = masses[:, None] * np.array([self.values["acceleration"], 0.0, 0.0])
        return lambda time, state: pull


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

    with_world(simulator, scene, look)


def _path(simulator: Simulator, kind: str, *effects: Effect) -> FloatArray:
    return rollout(simulator, sample_scenario(kind), sample_material(kind), effects).vertices


#: By title, what every simulator owes for every kind of body that it claims.
CHECKS: dict[str, Callable[[MakeSimulator, str], None]] = {
    "starts as the scene says": check_start,
    "held vertices are exact": check_held,
    "free fall": check_free_fall,
    "nodal forces accelerate": check_nodal_force,
    "nodal forces balance gravity": check_balance,
    "a force ends with its step": check_force_ends,
    "stretches as its stiffness says": check_stretch,
    "refines with the time step": check_refines,
    "repeats bit for bit": check_repeats,
    "an effect at zero changes nothing": check_zero_effect,
    "global random state untouched": check_random_state,
}
