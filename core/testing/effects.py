"""The conformance kit of effects."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ..arrays import FloatArray
from ..effect import ACTS_ON, Effect
from ..errors import InputError
from ..material import Material
from ..motion import Motion
from ..obstacles import Table
from ..parameters import Parameter
from ..rollout import rollout
from ..scenario import STANDARD_GRAVITY
from ..simulator import Simulator, State
from .checks import Check, check_leaves_random_state, check_pickles, must, must_raise, raise_failures
from .reference import ReferenceSimulator
from .samples import KINDS, sample_material, sample_scenario, sample_scene

#: A millionth of the range of every coefficient must not move anything by more than this [m].
FADED = 1e-4


def check_effect(effect: type[Effect], simulator: Simulator | None = None) -> None:
    """Hold an effect against everything that muslin relies on.

    Args:
        effect: the class.
        simulator: to try it on; default a small one in NumPy.

    Raises:
        AssertionError: lists every broken promise.
    """
    raise_failures("the effect", effect_checks(effect, simulator))


def effect_checks(effect: type[Effect], simulator: Simulator | None = None) -> list[Check]:
    """The checks of :func:`check_effect`, one a promise and kind of body."""
    engine = simulator or ReferenceSimulator()
    checks = [Check(title, partial(check, effect)) for title, check in _ONCE.items()]
    for kind in (k for k in KINDS if k in effect.object_kinds and k in engine.object_kinds):
        for title, look in _PER_KIND.items():
            checks.append(Check(f"{kind}: {title}", partial(look, effect, engine, kind)))
    return checks


def check_declares(effect: type[Effect]) -> None:
    """Name, what it acts on, kinds and coefficients are declared, with units and ranges around zero."""
    must(issubclass(effect, Effect), f"{effect.__name__} is not a muslin.core Effect")
    must(re.fullmatch(r"[a-z][a-z0-9-]*", effect.name), f"name {effect.name!r} must be lower-case words and hyphens")
    must(effect.acts_on in ACTS_ON, f"acts_on is {effect.acts_on!r}, but must be one of {', '.join(ACTS_ON)}")
    must(effect.object_kinds and set(effect.object_kinds) <= set(KINDS), f"object_kinds must be some of {KINDS}")
    must(effect.coefficients, "it declares no coefficients; without one it cannot be off")
    names = [c.name for c in effect.coefficients]
    must(len(set(names)) == len(names), f"a coefficient is declared twice: {names}")
    for c in effect.coefficients:
        must(isinstance(c, Parameter), f"coefficient {c!r} is not a Parameter")
        must(c.name.isidentifier(), f"coefficient name {c.name!r} must be an identifier")
        must(c.unit.strip(), f"coefficient {c.name!r} needs a unit; '1' for a pure number")
        must(c.low <= 0 <= c.high, f"coefficient {c.name!r} ranges from {c.low} to {c.high}, which leaves zero out")


def check_starts_off(effect: type[Effect]) -> None:
    """Without values, and with zeros, it is off; with a value it is not."""
    must(effect().is_off, "without values it is not off")
    must(effect(**{c.name: 0.0 for c in effect.coefficients}).is_off, "with all coefficients zero it is not off")
    for c in effect.coefficients:
        must(not effect(**{c.name: c.high or c.low}).is_off, f"with {c.name} = {c.high or c.low} it claims to be off")


def check_unknown_refused(effect: type[Effect]) -> None:
    """A coefficient that it does not have is an InputError."""
    must_raise(InputError, lambda: effect(no_such_coefficient=1.0), "it accepts a coefficient that it does not declare")


def check_pickled(effect: type[Effect]) -> None:
    """Class and values survive pickle."""
    one = effect(**_strong(effect))
    copy = check_pickles(one, "the effect")
    must(type(copy) is effect and copy.values == one.values, "a pickled copy has other values")


def check_zero(effect: type[Effect], simulator: Simulator, kind: str) -> None:
    """All coefficients zero leave the trajectory bit for bit."""
    zeros = effect(**{c.name: 0.0 for c in effect.coefficients})
    same = np.array_equal(_path(simulator, kind), _path(simulator, kind, zeros))
    must(same, "with all coefficients zero the trajectory differs from the one without the effect")


def check_fades(effect: type[Effect], simulator: Simulator, kind: str) -> None:
    """Coefficients near zero are nearly off: nothing jumps where the effect is switched on."""
    weak = effect(**{name: 1e-6 * value for name, value in _strong(effect).items()})
    apart = np.abs(_path(simulator, kind) - _path(simulator, kind, weak)).max()
    must(apart < FADED, f"a millionth of its range moves a vertex by {apart:.2g} m, so zero is not its limit")


def check_acts(effect: type[Effect], simulator: Simulator, kind: str) -> None:
    """At the ends of its ranges it does something, the same every time, also with one instance twice."""
    one = effect(**_strong(effect))
    first = _path(simulator, kind, one)
    must(np.isfinite(first).all(), "the trajectory is not finite")
    must(not np.array_equal(first, _path(simulator, kind)), f"with {one.values} the trajectory is the plain one")
    must(np.array_equal(first, _path(simulator, kind, one)), "a second rollout of the same instance differs")


def check_hooks(effect: type[Effect], simulator: Simulator, kind: str) -> None:
    """Every hook returns what its signature says, and leaves its arguments alone."""
    one = effect(**_strong(effect))
    material = sample_material(kind)
    changed: Material = one.on_material(material)
    must(type(changed) is type(material), f"on_material makes a {type(changed).__name__} of a {material.kind} material")
    gravity = _frozen(np.array([0.0, 0.0, -STANDARD_GRAVITY]))
    turned = np.asarray(one.on_gravity(gravity))
    must(turned.shape == (3,) and np.isfinite(turned).all(), f"on_gravity gives {turned}, not three finite numbers")
    told = sample_scenario(kind).motion
    made = one.on_command(told, 0.005)
    must(isinstance(made, Motion), f"on_command gives a {type(made).__name__}, not a Motion")
    must(made.grippers == told.grippers, f"on_command gives {made.grippers} grippers for {told.grippers}")
    must(np.isfinite(made.poses).all(), "on_command gives a pose that is not finite")
    still = one.on_command(Motion.still(), 0.005)
    must(still.grippers == 1, "on_command cannot handle a motion of a single pose")


def check_force(effect: type[Effect], simulator: Simulator, kind: str) -> None:
    """A nodal force is finite, one row a vertex, and its arguments stay as they were."""
    scene = sample_scene(kind)
    masses = scene.body.vertex_measures * scene.material.density
    force = effect(**_strong(effect)).bind(scene, _frozen(masses))
    must(force is not None or effect.acts_on != "force", "acts_on is 'force', but bind() gives None")
    if force is None:
        return
    rng = np.random.default_rng(0)
    at_rest = np.zeros_like(scene.body.vertices)
    for k, velocities in enumerate((at_rest, rng.normal(0, 1, at_rest.shape), rng.normal(0, 10, at_rest.shape))):
        positions = scene.body.vertices + 0.01 * rng.normal(0, 1, at_rest.shape)
        try:
            got = np.asarray(force(0.01 * k, State(_frozen(positions), _frozen(velocities))))
        except ValueError as error:
            must("read-only" not in str(error), "the force writes into the positions or velocities it is given")
            raise
        must(got.shape == at_rest.shape, f"the force has shape {got.shape}, not {at_rest.shape}")
        must(np.isfinite(got).all(), f"the force is not finite at velocities up to {np.abs(velocities).max():.2g} m/s")


def check_random_state(effect: type[Effect], simulator: Simulator, kind: str) -> None:
    """The global random generators are left alone."""
    check_leaves_random_state(lambda: _path(simulator, kind, effect(**_strong(effect))))


_ONCE: dict[str, Callable[[type[Effect]], None]] = {
    "declares itself": check_declares,
    "is off until told otherwise": check_starts_off,
    "refuses unknown coefficients": check_unknown_refused,
    "survives pickle": check_pickled,
}

_PER_KIND: dict[str, Callable[[type[Effect], Simulator, str], None]] = {
    "zero is exactly off": check_zero,
    "fades out towards zero": check_fades,
    "acts, and repeats": check_acts,
    "hooks return what they promise": check_hooks,
    "its force is well-formed": check_force,
    "global random state untouched": check_random_state,
}


def _strong(effect: type[Effect]) -> dict[str, float]:
    """Every coefficient at the end of its range that is further from zero."""
    return {c.name: c.high if abs(c.high) >= abs(c.low) else c.low for c in effect.coefficients}


def _frozen(array: FloatArray) -> FloatArray:
    array.flags.writeable = False
    return array


def _path(simulator: Simulator, kind: str, *effects: Effect) -> FloatArray:
    """What is seen of the carried object, whose lowest part touches a table."""
    scenario = sample_scenario(kind)
    table = Table(float(scenario.start_vertices()[:, 2].min()) - 0.002)
    return rollout(simulator, replace(scenario, obstacles=(table,)), sample_material(kind), effects).series.points
