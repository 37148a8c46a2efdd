"""Options that are given once for all files, or once each."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from ..core.errors import InputError

T = TypeVar("T")


def once_or_each(values: Sequence[T] | None, count: int, option: str, what: str) -> Sequence[T | None]:
    """One value for each of ``count`` files or takes."""
    if not values or len(values) == 1:
        return [values[0] if values else None] * count
    if len(values) != count:
        raise InputError(f"{option} is given {len(values)} times for {count} {what}s; give it once, or once a {what}")
    return values


def per_file(each: Mapping[str, Sequence[Any] | None], count: int) -> list[dict[str, Any]]:
    """For every file the options of its own; ``each`` are given once or once a file, but a name once a file."""
    names = each.get("name")
    if names and len(names) == 1 and count > 1:
        raise InputError(f"--name is given once for {count} files; give it once a file, in their order")
    told = {option: once_or_each(values, count, f"--{option}", "file") for option, values in each.items()}
    return [{option: values[k] for option, values in told.items()} for k in range(count)]
