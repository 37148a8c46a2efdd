"""The conformance kit of simulators."""

from functools import partial

from ..errors import InputError
from ..simulator import CAPABILITIES, Simulator
from . import abilities, motion
from .checks import Check, must, must_raise, raise_failures
from .samples import KINDS, sample_scene
from .worlds import MakeSimulator


def check_simulator(make: MakeSimulator) -> None:
    """Hold a simulator against everything that muslin relies on, in a few seconds.

    Args:
        make: builds the simulator: its class, if all options have defaults. If it takes ``time_step``,
            that is varied too.

    Raises:
        AssertionError: lists every broken promise.
    """
    raise_failures("the simulator", simulator_checks(make))


def simulator_checks(make: MakeSimulator) -> list[Check]:
    """The checks of :func:`check_simulator`, one a promise and kind of body.

    Every capability that is claimed must work, and every scene that needs one that is not must be refused.
    """
    simulator = make()
    checks = [Check("declares its name, kinds and engine version", partial(check_declares, make))]
    claimed = [k for k in KINDS if k in simulator.object_kinds]
    for kind in claimed:
        for title, check in motion.CHECKS.items():
            checks.append(Check(f"{kind}: {title}", partial(check, make, kind)))
        for ability in abilities.ABILITIES:
            if kind not in ability.kinds:
                continue
            if ability.name not in simulator.capabilities:
                if ability.scene is not None:
                    title = f"{kind}: refused where it needs {ability.name!r}, which is not claimed"
                    checks.append(Check(title, partial(check_refuses, make, ability, kind)))
            elif not ability.also - simulator.capabilities:
                for title, check in ability.checks.items():
                    checks.append(Check(f"{kind}: {title}", partial(check, make, kind)))
    for kind in KINDS:
        if kind not in claimed:
            checks.append(Check(f"{kind}: refused, as it is not claimed", partial(check_refuses_kind, make, kind)))
    return checks


def check_declares(make: MakeSimulator) -> None:
    """Name, kinds, capabilities and engine version say something."""
    simulator = make()
    must(isinstance(simulator, Simulator), f"{type(simulator).__name__} is not a muslin.core Simulator")
    must(simulator.name and isinstance(simulator.name, str), "name must be a text")
    unknown = set(simulator.capabilities) - set(CAPABILITIES)
    must(not unknown, f"capabilities must be some of {tuple(CAPABILITIES)}, not {sorted(unknown)}")
    wrong = set(simulator.object_kinds) - set(KINDS)
    must(simulator.object_kinds and not wrong, f"object_kinds must be some of {KINDS}, not {simulator.object_kinds}")
    must(simulator.engine_version().strip(), "engine_version() must name the engine and its version")


def check_refuses_kind(make: MakeSimulator, kind: str) -> None:
    """A kind of body that is not claimed is refused before anything is built."""
    complaint = f"check() lets a {kind} pass, which is not in object_kinds"
    must_raise(InputError, lambda: make().check(sample_scene(kind)), complaint)


def check_refuses(make: MakeSimulator, ability: "abilities.Ability", kind: str) -> None:
    """So is a scene that needs a capability that is not claimed."""
    assert ability.scene is not None
    scene = ability.scene(kind)
    complaint = f"check() lets a scene pass that needs {ability.name!r}, which is not in capabilities"
    must_raise(InputError, lambda: make().check(scene), complaint)
