"""Whether an effect can show at all in a scenario and on a simulator."""

from .effect import Effect
from .scenario import Scenario
from .simulator import CAPABILITIES, Simulator


def why_powerless(effect: type[Effect], simulator: Simulator, scenario: Scenario) -> str | None:
    """Why ``effect`` cannot act in ``scenario`` on ``simulator``, as a sentence, or None if it can."""
    name = effect.name
    if scenario.body.kind not in effect.object_kinds:
        return f"effect {name!r} is for {' and '.join(sorted(effect.object_kinds))}, not for a {scenario.body.kind}"
    missing = sorted(effect.needs - simulator.capabilities)
    if missing:
        what = CAPABILITIES.get(missing[0], repr(missing[0]))
        return f"effect {name!r} needs a simulator that can {what}, but {simulator.name!r} cannot"
    if effect.needs_kept_bend and scenario.kept is None:
        return f"effect {name!r} follows from how a held rope was seen to be bent; set [scenario] start = 'measured'"
    if effect.acts_on == "contact" and not scenario.obstacles:
        return f"effect {name!r} acts where the object touches something, but there is no obstacle"
    if effect.acts_on in ("grasp", "command") and not scenario.grasps:
        return f"effect {name!r} acts through a gripper, but nothing holds the object"
    return None
