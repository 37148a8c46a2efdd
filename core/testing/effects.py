"""The conformance kit of effects."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ..arrays import FloatArray, IntArray
from ..effect import ACTS_ON, Effect
from ..errors import InputError
from ..obstacles import Table
from ..parameters import Parameter
from ..rollout import rollout
from ..simulator import CAPABILITIES, Simulator
from . import hooks
from .checks import Check, check_leaves_random_state, check_pickles, must, must_raise, raise_failures
from .hooks import strongest, table_under
from .reference import ReferenceSimulator
from .samples import KINDS, sample_grasp, sample_material, sample_scenario, sample_scene

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
    """The checks of :func:`check_effect`, one a promise and kind of body.

    Those that need rollouts are left out on a simulator that cannot do what the effect needs.
    """
    engine = simulator or ReferenceSimulator()
    checks = [Check(title, partial(check, effect)) for title, check in _ONCE.items()]
    for kind in (k for k in KINDS if k in effect.object_kinds and k in engine.object_kinds):
        for title, look in _HOOKS.items():
            checks.append(Check(f"{kind}: {title}", partial(look, effect, kind)))
        if effect.dissipative:
            checks.append(Check(f"{kind}: never adds energy", partial(hooks.check_dissipative, effect, kind)))
        if not effect.needs - engine.capabilities:
            for title, run in _ROLLOUTS.items():
                checks.append(Check(f"{kind}: {title}", partial(run, effect, engine, kind)))
    return checks


def check_declares(effect: type[Effect]) -> None:
    """Name, what it acts on, kinds and coefficients are declared, with units and ranges around zero."""
    must(issubclass(effect, Effect), f"{effect.__name__} is not a muslin.core Effect")
    must(re.fullmatch(r"[a-z][a-z0-9-]*", effect.name), f"name {effect.name!r} must be lower-case words and hyphens")
    must(effect.acts_on in ACTS_ON, f"acts_on is {effect.acts_on!r}, but must be one of {', '.join(ACTS_ON)}")
    must(effect.object_kinds and set(effect.object_kinds) <= set(KINDS), f"object_kinds must be some of {KINDS}")
    unknown = set(effect.needs) - set(CAPABILITIES)
    must(not unknown, f"needs must be some of {tuple(CAPABILITIES)}, not {sorted(unknown)}")
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
    one = effect(**strongest(effect))
    copy = check_pickles(one, "the effect")
    must(type(copy) is effect and copy.values == one.values, "a pickled copy has other values")


def check_zero(effect: type[Effect], simulator: Simulator, kind: str) -> None:
    """All coefficients zero leave the trajectory bit for bit."""
    zeros = effect(**{c.name: 0.0 for c in effect.coefficients})
    same = np.array_equal(_path(simulator, kind), _path(simulator, kind, zeros))
    must(same, "with all coefficients zero the trajectory differs from the one without the effect")


def check_fades(effect: type[Effect], simulator: Simulator, kind: str) -> None:
    """Coefficients near zero are nearly off: nothing jumps where the effect is switched on."""
    weak = effect(**{name: 1e-6 * value for name, value in strongest(effect).items()})
    apart = np.abs(_path(simulator, kind) - _path(simulator, kind, weak)).max()
    must(apart < FADED, f"a millionth of its range moves a vertex by {apart:.2g} m, so zero is not its limit")


def check_acts(effect: type[Effect], simulator: Simulator, kind: str) -> None:
    """At the ends of its ranges it does something, the same every time, also with one instance twice."""
    one = effect(**strongest(effect))
    first = _path(simulator, kind, one)
    must(np.isfinite(first).all(), "the trajectory is not finite")
    must(not np.array_equal(first, _path(simulator, kind)), f"with {one.values} the trajectory is the plain one")
    must(np.array_equal(first, _path(simulator, kind, one)), "a second rollout of the same instance differs")


def check_random_state(effect: type[Effect], simulator: Simulator, kind: str) -> None:
    """The global random generators are left alone."""
    check_leaves_random_state(lambda: _path(simulator, kind, effect(**strongest(effect))))


_ONCE: dict[str, Callable[[type[Effect]], None]] = {
    "declares itself": check_declares,
    "is off until told otherwise": check_starts_off,
    "refuses unknown coefficients": check_unknown_refused,
    "survives pickle": check_pickled,
}

#: What needs no rollout: with the effect and a kind of body.
_HOOKS: dict[str, Callable[[type[Effect], str], None]] = {
    "hooks return what they promise": hooks.check_hooks,
    "what it binds is well-formed": hooks.check_force,
}

#: What is tried in rollouts: with the simulator, too.
_ROLLOUTS: dict[str, Callable[[type[Effect], Simulator, str], None]] = {
    "zero is exactly off": check_zero,
    "fades out towards zero": check_fades,
    "acts, and repeats": check_acts,
    "global random state untouched": check_random_state,
}


def _grasp(kind: str) -> tuple[IntArray, ...]:
    """A solid is held by its upper side, or nothing that is free would touch the table."""
    body = sample_scene(kind).body
    return (np.argsort(body.vertices[:, 2])[-9:] if kind == "solid" else sample_grasp(body),)


def _path(simulator: Simulator, kind: str, *effects: Effect) -> FloatArray:
    """What is seen of the carried object, whose lowest part sags onto a table."""
    scenario = replace(sample_scenario(kind), grasps=_grasp(kind))
    lowest = float(scenario.start_vertices()[:, 2].min()) - float(scenario.body.vertices[:, 2].min())
    table = Table(table_under(kind).height + lowest)
    return rollout(simulator, replace(scenario, obstacles=(table,)), sample_material(kind), effects).series.points
