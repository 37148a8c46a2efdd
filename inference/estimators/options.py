"""Options of an estimator: a frozen dataclass of its settings, presets of it, and what a user puts over one."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar

from ...core.errors import InputError
from ...core.registry import nearest

T = TypeVar("T")


def with_options(
    name: str, presets: Mapping[str, T], preset: str, options: Mapping[str, Any], may_be_zero: tuple[str, ...] = ()
) -> T:
    """A preset with options put over it.

    Each option must be of the kind that the preset has: true or false, text, widths of layers, or a number
    above zero.

    Args:
        name: of the estimator, for messages.
        presets: frozen dataclass instances by name.
        preset: which to start from.
        options: values by field.
        may_be_zero: fields for which zero makes sense.

    Raises:
        InputError: an unknown preset or option, or a value out of range.
    """
    if preset not in presets:
        raise InputError(f"{name} has no preset {preset!r}; it has {', '.join(presets)}")
    base = presets[preset]
    known = [f.name for f in fields(base)]  # type: ignore[arg-type]
    for option, value in options.items():
        if option not in known:
            near, all_of_them = nearest(option, ["preset", *known]), ", ".join(["preset", *known])
            raise InputError(f"{name} has no option {option!r}.{near} Options: {all_of_them}")
        checked = _checked(name, option, value, getattr(base, option), option in may_be_zero)
        base = replace(base, **{option: checked})  # type: ignore[type-var]
    return base


def _checked(name: str, option: str, value: Any, default: Any, zero: bool) -> Any:
    if isinstance(default, bool | str):
        if not isinstance(value, type(default)):
            kind = "true or false" if isinstance(default, bool) else "text"
            raise InputError(f"{name}: {option} must be {kind}, not {value!r}")
        return value
    if isinstance(default, tuple):
        if not isinstance(value, list | tuple) or not value or not all(isinstance(v, int) and v > 0 for v in value):
            raise InputError(f"{name}: {option} must be a list of widths above zero, not {value!r}")
        return tuple(value)
    if isinstance(value, bool) or not isinstance(value, int | float) or value < 0 or not (value or zero):
        raise InputError(f"{name}: {option} must be a number {'zero or more' if zero else 'above zero'}, not {value!r}")
    return type(default)(value)
