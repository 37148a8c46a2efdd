"""The kits by kind of plugin, as ``muslin check`` runs them."""

from collections.abc import Callable, Iterator
from typing import Any

from .checks import Check, run_all
from .datasets import dataset_checks
from .effects import effect_checks
from .estimators import installed_estimator_checks
from .extractors import extractor_checks
from .renderers import renderer_checks
from .simulators import simulator_checks

#: Kind -> the checks of one plugin of that kind.
KITS: dict[str, Callable[[Any], list[Check]]] = {
    "simulator": simulator_checks,
    "extractor": extractor_checks,
    "effect": effect_checks,
    "renderer": renderer_checks,
    "estimator": installed_estimator_checks,
    "dataset": dataset_checks,
}


def run_checks(kind: str, plugin: Any) -> Iterator[tuple[str, str | None]]:
    """Title and complaint of every check of a plugin, the complaint None where it passed."""
    try:
        checks = KITS[kind](plugin)
    except Exception as error:  # a plugin that cannot even be built has failed its first check
        yield "can be built without options", f"{type(error).__name__}: {error}"
        return
    yield from run_all(checks)
