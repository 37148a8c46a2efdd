"""Saved posteriors: the file says its format, the format the class."""

import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError, MissingFileError, StoreError
from ...core.estimator import Posterior
from ...core.parameters import Parameter, ParameterSpace
from ...core.store import damage_errors, read
from ...core.study import Study

#: Modules of this package whose posteriors are known without being imported first. Those of a plugin are known once
#: its module is imported.
BUILT_IN = ("mixture", "fusion", "flow", "stacked")


def _kinds(base: Any) -> Iterator[type[Posterior]]:  # Any: a type[Posterior] would have to be concrete
    for kind in base.__subclasses__():
        yield kind
        yield from _kinds(kind)


def formats() -> dict[str, type[Posterior]]:
    """Every known format, and the class that reads it."""
    for module in BUILT_IN:
        import_module(f".{module}", __package__)
    return {kind.format: kind for kind in _kinds(Posterior) if kind.format}


def load_posterior(path: str | Path) -> Posterior:
    """A saved posterior, of whatever class.

    Raises:
        MissingFileError: there is no such file.
        InputError: it is not a saved posterior, or one of a class that is not known here.
    """
    path = Path(path)
    if not path.is_file():
        raise MissingFileError(f"no posterior at {path}")
    try:
        with np.load(path, allow_pickle=False) as data:
            name = str(data["format"])
    except (KeyError, OSError, ValueError, AttributeError, EOFError) as error:
        raise InputError(f"{path} is not a saved posterior: it names no format ({error})") from error
    known = formats()
    if name not in known:
        raise InputError(
            f"{path} is a posterior of format {name!r}, but known are {', '.join(sorted(known))}; "
            "import the plugin that made it first"
        )
    return known[name].load(path)


def fitted_posterior(study: Study) -> Posterior:
    """The posterior on the unit cube that the last fit of a study found.

    Raises:
        StepMissingError: it has not been fitted since it changed.
        StoreError: the store is damaged.
    """
    content = read(study.step_results("fit"), "posterior_file")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "posterior.npz"
        path.write_bytes(content.astype(np.uint8).tobytes())
        try:
            return load_posterior(path)
        except InputError as error:
            said = str(error).replace(str(path), "the posterior")
            raise StoreError(f"{study.results_path}: {said}; move it away and run the fit again") from error


def fitted_space(study: Study) -> ParameterSpace:
    """The parameters that the last fit of a study inferred, as it has written them.

    Raises:
        StepMissingError: it has not been fitted since it changed.
        StoreError: the store is damaged.
    """
    group = study.step_results("fit")
    with damage_errors(study.results_path):
        table: dict[str, Any] = dict(group.attrs)
        columns = (table[key] for key in ("parameters", "units", "low", "high", "scale"))
        return ParameterSpace(tuple(Parameter(*row) for row in zip(*columns, strict=True)))
