"""What a study infers and what it fixes: fields of the material, and coefficients of effects."""

from collections.abc import Mapping
from dataclasses import fields

from ..effect import Effect
from ..errors import InputError, RolloutFailed
from ..material import UNITS, Material, check_meant, with_fields
from ..parameters import Parameter
from ..registry import nearest
from .config import ParameterTable, StudyConfig


def given_material(config: StudyConfig, default: Material) -> Material:
    """The material with what the study says of it; values that cannot be meant are refused."""
    material = with_fields(default, dict(config.material))
    for name, value in config.material.items():
        try:
            check_meant(material.kind, name, value)
        except InputError as error:
            raise InputError(f"[material.{name}]: {error}") from error
    return material


def material_parameters(config: StudyConfig, material: Material) -> tuple[Parameter, ...]:
    """What is inferred of the ``material``, and of the size; bounds that it cannot have are refused."""
    out = []
    for name, table in config.parameters.items():
        if name not in (*(f.name for f in fields(material)), "scale"):
            known = [*(f.name for f in fields(material)), "scale"]
            raise InputError(f"[parameters.{name}]: unknown.{nearest(name, known)} Known: {', '.join(known)}")
        out.append(_parameter(name, table, UNITS[material.kind][name], f"parameters.{name}"))
        for bound in (table.low, table.high):
            _check_bound(material, name, bound)
    return tuple(out)


def _check_bound(material: Material, name: str, bound: float) -> None:
    """A bound that no material can have is said now, not in the middle of a fit."""
    if name == "scale":
        if bound <= 0:
            raise InputError(f"[parameters.scale]: must be above zero, but a bound is {bound:g}")
        return
    try:
        with_fields(material, {name: bound})
        check_meant(material.kind, name, bound)
    except InputError as error:
        raise InputError(f"[parameters.{name}]: {error}") from error


def _parameter(name: str, table: ParameterTable, unit: str, where: str) -> Parameter:
    if table.unit is not None and table.unit != unit:
        raise InputError(f"[{where}]: unit is {table.unit!r}, but {name} is in {unit!r}; convert low and high")
    return Parameter(name, unit, table.low, table.high, table.scale)


def effect_values(
    config: StudyConfig, effects: Mapping[str, type[Effect]], material: Material
) -> tuple[tuple[Parameter, ...], dict[str, float]]:
    """Coefficients of ``effects`` that are inferred, and the values of those that are not.

    Raises:
        InputError: an effect has no such coefficient, or cannot have such a value or bound of a prior.
    """
    inferred: list[Parameter] = []
    fixed: dict[str, float] = {}
    for effect, table in config.effects.items():
        declared = {p.name: p for p in effects[effect].parameters()}
        given = {f"{effect}.{c}": v for c, v in table.items()}
        for name in given:
            if name not in declared:
                known = [n.split(".", 1)[1] for n in declared]
                raise InputError(f"[effects.{effect}] has no {name.split('.', 1)[1]!r}; it has {', '.join(known)}")
        ends: list[dict[str, float]] = [{}, {}]
        for name, p in declared.items():
            value = given.get(name)
            if isinstance(value, ParameterTable):
                p = _parameter(name, value, p.unit, f"effects.{name}")
            if value is None or isinstance(value, ParameterTable):
                inferred.append(p)
                low, high = p.low, p.high
            else:
                low = high = fixed[name] = float(value)
            if low < 0 <= declared[name].low:
                raise InputError(f"[effects.{name}]: must not be below zero, but is or may be {low:g} {p.unit}")
            for end, bound in zip(ends, (low, high), strict=True):
                end[name.split(".", 1)[1]] = bound
        _check_ends(effects[effect], ends, material)
    return tuple(inferred), fixed


def _check_ends(effect: type[Effect], ends: list[dict[str, float]], material: Material) -> None:
    """Coefficients with which no such material is left are said now, not in the middle of a fit."""
    for values in ends:
        one = effect(**values)
        try:
            if not one.is_off:
                one.relaxed(one.on_material(material))
        except RolloutFailed:  # with another material it may not: a draw fails, no study
            continue
        except InputError as error:
            told = ", ".join(f"{name} = {value:g}" for name, value in values.items())
            raise InputError(f"[effects.{effect.name}] with {told}: {error}") from error
