"""The step ``add-law``: a study with the law of a file as an effect, every other term of the library off."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from ....core.errors import InputError, MissingFileError
from ....core.parameters import Parameter
from ....core.registry import REGISTRY, nearest
from ....core.study import Study
from ....core.study.config import ParameterTable
from .refit import LAW
from .result import VERSION

#: The prior of a coefficient reaches so far from the fitted one: standard deviations, and share of it.
DEVIATIONS, SHARE = 6.0, 0.5
#: A coefficient is refused if it lies outside of the range of its term.
_MARGIN = 1e-9


def read_law(path: Path) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of every coefficient in a file that ``muslin unknown --json`` wrote.

    Raises:
        MissingFileError, InputError: there is no such file, or none with a law for this version.
    """
    if not path.is_file():
        raise MissingFileError(f"there is no law file {path}; make one with: muslin unknown STUDY.toml --json {path}")
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is not a JSON file: {error}") from error
    if not isinstance(content, dict) or "law" not in content:
        raise InputError(
            f"{path} is no law file: it has no key 'law'; muslin unknown STUDY.toml --json FILE writes one"
        )
    if content.get("version") != VERSION:
        raise InputError(f"{path} is of version {content.get('version')!r}, but this muslin reads laws of {VERSION}")
    if content["law"] is None:
        raise InputError(f"{path} holds no law: the verdict was {content.get('verdict')!r}, nothing to add")
    known = {c.name: c for c in REGISTRY.get("effect", LAW).coefficients}
    terms = content["law"].get("terms") if isinstance(content["law"], dict) else None
    if not isinstance(terms, dict) or not terms:
        raise InputError(f"{path}: [law.terms] is missing or empty; it maps names of terms to mean, sd and unit")
    return {name: _coefficient(path, name, table, known) for name, table in terms.items()}


def _coefficient(path: Path, name: str, table: Any, known: dict[str, Parameter]) -> tuple[float, float]:
    if name not in known:
        raise InputError(f"{path}: there is no term {name!r}.{nearest(name, list(known))} Terms: {', '.join(known)}")
    try:
        mean, sd, unit = float(table["mean"]), float(table["sd"]), table["unit"]
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{path}: [law.terms.{name}] needs numbers mean and sd, and a unit; got {table!r:.80}"
        ) from error
    p = known[name]
    if unit != p.unit:
        raise InputError(f"{path}: [law.terms.{name}] is in {unit!r}, but the term is in {p.unit!r}; convert it")
    if not (np.isfinite(mean) and np.isfinite(sd) and sd >= 0):
        raise InputError(f"{path}: [law.terms.{name}] needs finite numbers and sd from zero up, got {mean} and {sd}")
    if not p.low - _MARGIN <= mean <= p.high + _MARGIN:
        raise InputError(f"{path}: [law.terms.{name}] is {mean:g} {unit}, outside of {p.low:g} to {p.high:g}")
    return mean, sd


def law_effect(path: Path) -> dict[str, float | ParameterTable]:
    """The table ``[effects.law]`` of a law file: priors about its coefficients, zero for all other terms."""
    law = read_law(path)
    out: dict[str, float | ParameterTable] = {}
    for p in REGISTRY.get("effect", LAW).coefficients:
        if p.name not in law:
            out[p.name] = 0.0
            continue
        mean, sd = law[p.name]
        reach = max(DEVIATIONS * sd, SHARE * abs(mean), 1e-3 * (p.high - p.low))
        out[p.name] = ParameterTable(low=max(p.low, mean - reach), high=min(p.high, mean + reach), unit=p.unit)
    return out


def add_law(study: Study, law: Path, output: Path | None = None, *, overwrite: bool = False) -> Study:
    """A study of the same model with the law of a file, its coefficients inferred.

    Where the study has a law already, what was still missing with it is added to that.

    Args:
        study: to start from.
        law: file of ``muslin unknown --json``.
        output: the new study file; default ``STEM-with-law.toml`` beside the study.
        overwrite: replace a file that is there.

    Raises:
        InputError: the study has these terms already, or the file holds none.
    """
    table = law_effect(law)
    if LAW not in study.config.effects:
        return study.add(LAW, output, overwrite=overwrite, coefficients=table)
    known = study.config.effects[LAW]
    new = {name: prior for name, prior in table.items() if prior != 0.0}
    twice = [name for name in new if known.get(name) != 0.0]
    if twice:
        raise InputError(
            f"{study.path} has a law already, with {' and '.join(twice)} in it; start from the study that {law} was "
            "learned from"
        )
    config = study.config.model_copy(deep=True)
    del config.effects[LAW]
    without = Study(config, study.path, workers=study.workers, progress=study.progress)
    return without.add(LAW, output, overwrite=overwrite, coefficients={**known, **new})
