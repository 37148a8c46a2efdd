"""The conformance kit of effects."""

import re
from collections.abc import Callable
from functools import partial

import numpy as np

from ..effect import ACTS_ON, Effect
from ..errors import InputError
from ..parameters import Parameter
from ..simulator import CAPABILITIES, Simulator
from . import hooks
from .checks import Check, check_leaves_random_state, check_pickles, must, must_raise, raise_failures
from .hooks import strongest
from .reference import ReferenceSimulator
from .samples import KINDS
from .stage import Meter, Stage

#: Shares of the ranges of all coefficients that must not move anything by more than :data:`FADED`.
FAINT = (1e-6, 3e-7, 1e-7)
FADED = 1e-4  # [m]
#: Share of the work either way that a dissipative effect may seem to do, as its forces are held through steps.
GIVEN_BACK = 0.02
#: Share of the ranges at which that is looked at.
MODERATE = 0.3
#: How many times as far as other trifles an effect may move an object whose contact amplifies everything.
CHANCE = 3.0


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
            stage = Stage(engine, kind)
            rollouts = {**_ROLLOUTS, **(_DISSIPATIVE if effect.dissipative else {})}
            for title, run in rollouts.items():
                checks.append(Check(f"{kind}: {title}", partial(run, effect, stage)))
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


def check_zero(effect: type[Effect], stage: Stage) -> None:
    """All coefficients zero leave the trajectory bit for bit."""
    zeros = effect(**{c.name: 0.0 for c in effect.coefficients})
    same = np.array_equal(stage.plain, stage.path(zeros))
    must(same, "with all coefficients zero the trajectory differs from the one without the effect")


def check_fades(effect: type[Effect], stage: Stage) -> None:
    """Coefficients near zero are nearly off: nothing jumps where the effect is switched on.

    The contact of some engines makes millimetres of a rounding error. There an effect may move the object on the
    table by some times what other trifles do; it is then looked at without the table, too, where it may not.
    """
    nearly_off = [effect(**{n: share * value for n, value in strongest(effect).items()}) for share in FAINT]
    apart = np.inf
    for weak in nearly_off:
        apart = min(apart, float(np.abs(stage.plain - stage.path(weak)).max()))
        if apart < FADED:
            return
    allowed = FADED + CHANCE * stage.amplified
    must(
        apart < allowed,
        f"a millionth of its range moves a vertex by {apart:.2g} m, so zero is not its limit; {allowed:.2g} m are "
        "allowed on this simulator",
    )
    apart = float(np.abs(stage.in_the_air - stage.path(nearly_off[0], touching=False)).max())
    must(apart < FADED, f"a millionth of its range moves a vertex by {apart:.2g} m in the air: zero is not its limit")


def check_takes_energy(effect: type[Effect], stage: Stage) -> None:
    """Its forces never have done more work on the object, from its start at rest, than they have taken.

    At :data:`MODERATE` strength: the samples are light and soft, and a force that is held through a step chatters
    where it outdoes all others. At the end of its range the friction within a rope gives some of it back for a while.
    """
    meter = Meter(effect(**{name: MODERATE * value for name, value in strongest(effect).items()}))
    stage.path(meter)
    work, passed = np.cumsum(meter.work), np.cumsum(np.abs(meter.work))
    excess = work - (GIVEN_BACK * passed + 1e-12)
    if not (excess <= 0).all():
        k = int(np.argmax(excess))
        raise AssertionError(
            f"it is dissipative, but after {k + 1} steps it has put {work[k]:.2g} J into the object, of "
            f"{passed[k]:.2g} J that went either way"
        )


def check_acts(effect: type[Effect], stage: Stage) -> None:
    """At the ends of its ranges it does something, the same every time, also with one instance twice."""
    one = effect(**strongest(effect))
    first = stage.path(one)
    must(np.isfinite(first).all(), "the trajectory is not finite")
    must(not np.array_equal(first, stage.plain), f"with {one.values} the trajectory is the plain one")
    must(np.array_equal(first, stage.path(one)), "a second rollout of the same instance differs")


def check_random_state(effect: type[Effect], stage: Stage) -> None:
    """The global random generators are left alone."""
    check_leaves_random_state(lambda: stage.path(effect(**strongest(effect))))


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

#: What is tried in rollouts.
_ROLLOUTS: dict[str, Callable[[type[Effect], Stage], None]] = {
    "zero is exactly off": check_zero,
    "fades out towards zero": check_fades,
    "acts, and repeats": check_acts,
    "global random state untouched": check_random_state,
}

#: And if the effect is dissipative.
_DISSIPATIVE: dict[str, Callable[[type[Effect], Stage], None]] = {"takes energy in a rollout": check_takes_energy}
