"""What the hooks of an effect must return, looked at without a simulator."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from ..arrays import FloatArray
from ..effect import Effect
from ..material import Material
from ..motion import Motion
from ..obstacles import Table
from ..scenario import STANDARD_GRAVITY
from ..scene import Scene
from ..simulator import State
from .checks import must
from .samples import sample_material, sample_scenario, sample_scene


def strongest(effect: type[Effect]) -> dict[str, float]:
    """Every coefficient at the end of its range that is further from zero."""
    return {c.name: c.high if abs(c.high) >= abs(c.low) else c.low for c in effect.coefficients}


def table_under(kind: str) -> Table:
    """One onto which the lowest part of the sample sags, a solid less than the others."""
    height = float(sample_scene(kind).body.vertices[:, 2].min())
    return Table(height - (0.0001 if kind == "solid" else 0.002))


def check_hooks(effect: type[Effect], kind: str) -> None:
    """Every hook returns what its signature says, and leaves its arguments alone."""
    one = effect(**strongest(effect))
    material = sample_material(kind)
    changed: Material = one.on_material(material)
    must(type(changed) is type(material), f"on_material makes a {type(changed).__name__} of a {material.kind} material")
    left: Material = one.relaxed(material)
    must(type(left) is type(material), f"relaxed makes a {type(left).__name__} of a {material.kind} material")
    told = sample_scenario(kind).motion
    made = one.on_command(told, 0.005)
    must(isinstance(made, Motion), f"on_command gives a {type(made).__name__}, not a Motion")
    must(made.grippers == told.grippers, f"on_command gives {made.grippers} grippers for {told.grippers}")
    must(np.isfinite(made.poses).all(), "on_command gives a pose that is not finite")
    still = one.on_command(Motion.still(), 0.005)
    must(still.grippers == 1, "on_command cannot handle a motion of a single pose")
    scenario = sample_scenario(kind)
    bent = one.on_body(scenario, material, np.array([0.0, 0.0, -STANDARD_GRAVITY]))
    same = bent.kind == kind and np.array_equal(bent.elements, scenario.body.elements)
    must(same, "on_body gives an object of other elements")
    must(np.allclose(bent.measures, scenario.body.measures, rtol=1e-6), "on_body gives elements of another size")
    body, times = sample_scene(kind).body, np.linspace(0.0, 0.3, 16)
    points = np.random.default_rng(0).normal(0.0, 0.1, (16, 4, 3))
    loads = np.full(len(body.vertices), 1e-3)
    arrays: list[tuple[str, Callable[[FloatArray], FloatArray], FloatArray]] = [
        ("on_gravity", one.on_gravity, np.array([0.0, 0.0, -STANDARD_GRAVITY])),
        ("on_obstacles", one.on_obstacles, np.array([0.8, 0.0, 0.0, 0.6])),
        ("on_loads", lambda a: one.on_loads(body, material, a), loads),
        ("on_clock", one.on_clock, times),
        ("on_points", one.on_points, points),
    ]
    for name, hook, given in arrays:
        got = _returned(name, hook, given)
        must(got.shape == given.shape, f"{name} gives shape {got.shape} for {given.shape}")
        must(np.isfinite(got).all(), f"{name} gives a number that is not finite")
    size = float(np.linalg.norm(one.on_obstacles(np.array([0.8, 0.0, 0.0, 0.6]))))
    must(abs(size - 1.0) < 1e-9, f"on_obstacles gives a quaternion of length {size:.3g}, not 1")
    must((one.on_loads(body, material, loads) >= 0).all(), "on_loads gives a negative mass")
    must((np.diff(one.on_clock(times)) >= 0).all(), "on_clock makes later frames be seen earlier")
    seen = points.copy()
    seen[3, 1] = np.nan
    hidden = np.asarray(np.isnan(one.on_points(seen)).any(axis=2))
    must(hidden[3, 1] and hidden.sum() == 1, "on_points must keep a point that is not seen NaN, and no other")
    first = one.on_points(points[:1])[0]
    back = _returned("off_points", lambda a: one.off_points(a, first), first)
    must(np.allclose(back, points[0], atol=1e-9), "off_points does not undo on_points")


def check_force(effect: type[Effect], kind: str) -> None:
    """What bind, bind_stiffness and bind_grasp give is well-formed, and fresh in every rollout."""
    scene = replace(sample_scene(kind, held=True), obstacles=(table_under(kind),))
    count, elements = len(scene.body.vertices), len(scene.body.elements)
    masses = _frozen(scene.body.vertex_measures * scene.material.density)
    one = effect(**strongest(effect))
    target = _frozen(scene.body.vertices[scene.held])

    def bound() -> dict[str, tuple[Callable[..., FloatArray] | None, tuple[int, ...]]]:
        grasp = one.bind_grasp(scene, masses)
        return {
            "force": (one.bind(scene, masses), (count, 3)),
            "stiffness": (one.bind_stiffness(scene), (elements,)),
            "grasp": (None if grasp is None else lambda t, s: grasp(t, s, target), (len(target), 3)),
        }

    first, second = bound(), bound()
    must(effect.acts_on != "force" or first["force"][0] is not None, "acts_on is 'force', but bind() gives None")
    for name, (law, shape) in first.items():
        again = second[name][0]
        if law is None or again is None:
            continue
        must(name != "stiffness" or "varying-stiffness" in effect.needs, "needs must name 'varying-stiffness'")
        asked: list[bool] = []
        path = list(_states(scene, asked))
        try:
            values = [np.asarray(law(time, state)) for time, state in path]
        except ValueError as error:
            must("read-only" not in str(error), f"the {name} writes into arrays that it is given")
            raise
        must(not asked or "contact-forces" in effect.needs, "it asks for contact forces: needs must name them")
        for got in values:
            must(got.shape == shape, f"the {name} has shape {got.shape}, not {shape}")
            must(np.isfinite(got).all(), f"the {name} is not finite at velocities of up to some 30 m/s")
        must(name != "stiffness" or all((v > 0).all() for v in values), "a factor on the stiffness is not above zero")
        repeated = [np.asarray(again(time, state)) for time, state in path]
        same = all(np.array_equal(a, b) for a, b in zip(values, repeated, strict=True))
        must(same, f"the {name} of a second bind() differs: what it remembers must be of one rollout alone")


def _states(scene: Scene, asked: list[bool]) -> Iterator[tuple[float, State]]:
    """Times and states at rest, slow and fast; notes in ``asked`` if contact forces are asked for."""
    rng = np.random.default_rng(0)
    start = scene.body.vertices
    push = _frozen(np.tile([0.0, 0.0, 0.01], (len(start), 1)))

    def contacts() -> FloatArray:
        asked.append(True)
        return push

    for k, speed in enumerate((0.0, 1.0, 10.0)):
        positions = start + (0.01 * rng.normal(0, 1, start.shape) if k else 0.0)
        yield 0.01 * k, State(_frozen(positions), _frozen(speed * rng.normal(0, 1, start.shape)), contacts)


def check_dissipative(effect: type[Effect], kind: str) -> None:
    """Whatever way the object is moved from rest, its force has never done more work on it than it took.

    In the sum over the path to each time, since a force that remembers, as that of internal friction, gives
    back a part of what it took. What acts through the material may raise damping and friction alone, and no
    other hook has a part in it.
    """
    one = effect(**strongest(effect))
    for hook in ("relaxed", "on_body", "on_gravity", "on_obstacles", "on_command", "on_loads", "bind_grasp"):
        own = getattr(effect, hook) is not getattr(Effect, hook)
        must(not own, f"it is dissipative, but acts through {hook}, which can add energy")
    material = sample_material(kind)
    before, after = vars(material), vars(one.on_material(material))
    for name, value in before.items():
        fine = after[name] >= value if name in ("damping_time", "friction") else after[name] == value
        must(fine, f"it is dissipative, but on_material turns {name} from {value:g} into {after[name]:g}")
    scene = replace(sample_scene(kind, held=True), obstacles=(table_under(kind),))
    must(one.bind_stiffness(scene) is None, "it is dissipative, but varies the stiffness, which can add energy")
    masses = scene.body.vertex_measures * material.density
    rng = np.random.default_rng(1)
    start = scene.body.vertices
    step, times = 0.002, np.arange(0.0, 0.6, 0.002)
    for size in (0.001, 0.01, 0.05):
        rate, reach = rng.uniform(5.0, 30.0, start.shape), size * rng.normal(0, 1, start.shape)
        force = one.bind(scene, masses)
        if force is None:
            return
        weight = np.where((start[:, 2] < start[:, 2].min() + 0.01)[:, None], masses[:, None] * [0.0, 0.0, 9.8], 0.0)
        work, passed, last = 0.0, 0.0, None
        for t in times.tolist():
            x = start + reach * (1.0 - np.cos(rate * t))
            v = reach * rate * np.sin(rate * t)
            got = np.asarray(force(t, State(x, v, lambda weight=weight: weight)))  # type: ignore[misc]
            if last is not None:
                done = float(np.sum(0.5 * (got + last[1]) * (x - last[0])))
                work, passed = work + done, passed + abs(done)
            last = (x, got)
            must(
                work <= 0.02 * passed + 1e-12,
                f"it is dissipative, but {t:.3f} s after rest it has put {work:.2g} J into the object, of "
                f"{passed:.2g} J that went either way in steps of {step:g} s",
            )


def _frozen(array: FloatArray) -> FloatArray:
    array.flags.writeable = False
    return array


def _returned(name: str, hook: Callable[[FloatArray], FloatArray], given: FloatArray) -> FloatArray:
    try:
        return np.asarray(hook(_frozen(given)))
    except ValueError as error:
        must("read-only" not in str(error), f"{name} writes into the array that it is given")
        raise
