"""Which effects a diagnosis tries."""

from ...core.errors import BrokenPluginError, InputError
from ...core.powerless import why_powerless
from ...core.registry import REGISTRY
from ...core.study import Study


def candidate_names(study: Study) -> list[str]:
    """The effects to try: those of the study file, or all installed ones that can act here and are not in yet.

    Raises:
        InputError: none is left, or one that the study names cannot act.
        UnknownPluginError, BrokenPluginError: for one that the study names.
    """
    problem = study.problem
    scenario = problem.scenarios[problem.fit_on[0]]
    told = study.config.diagnose.candidates
    names = told if told is not None else REGISTRY.names("effect")
    out = []
    for name in dict.fromkeys(names):
        try:
            effect = REGISTRY.get("effect", name)
        except BrokenPluginError as error:
            if told is not None:
                raise
            study.progress(f"left out: {error}", 0, 0)
            continue
        reason = why_powerless(effect, problem.simulator, scenario)
        if told is not None and reason is not None:
            raise InputError(f"[diagnose.candidates]: {reason}")
        wanted = told is not None or effect.candidate
        if name not in study.config.effects and reason is None and wanted:
            out.append(name)
    if not out:
        raise InputError(f"{study.path}: no candidate effect is left to try; see: muslin plugins")
    return out
