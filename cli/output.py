"""Files that commands write: checked before the work starts."""

import json
import math
import os
from pathlib import Path
from typing import Any

from ..core.errors import InputError, MissingFileError
from ..core.store import write_text
from ..core.study import Study


def check_output(path: Path, force: bool) -> None:
    """Refuse a place where nothing can be written, and a file that is there unless ``force``."""
    parent = path.absolute().parent
    if not parent.is_dir():
        raise MissingFileError(f"there is no folder {parent} for {path.name}; make it first")
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a file in it")
    if path.exists() and not force:
        raise InputError(f"{path} exists already; choose another name, or say --force to replace it")
    if not os.access(parent, os.W_OK):
        raise InputError(f"no permission to write in {parent}")


def check_result(path: Path, ending: str, *studies: Study) -> None:
    """Refuse a place for a result that every run writes anew; of what is there only a file of that ending is replaced.

    Nothing of ``studies`` is replaced, see :func:`check_apart`.
    """
    for study in studies:
        check_apart(path, study)
    check_output(path, force=True)
    if path.exists() and path.suffix != ending:
        raise InputError(f"{path} exists already, and only a {ending} file is replaced; name one, or a new file")


def check_apart(path: Path, study: Study) -> None:
    """Refuse to write over a study, a file that it names or a store of its own, or into one, whatever was said."""
    place, own = path.resolve(), study.path.resolve()
    if place == own:
        raise InputError(f"{path} is the study itself; name another file to write")
    for what, store in (("measurement", study.measurement_path), ("results", study.results_path)):
        if place.is_relative_to(store.resolve()):
            raise InputError(f"{path} lies in the {what} of {study.path}; name a file outside of {store}")
    if place in [(own.parent / name).resolve() for name in study.config.files]:
        raise InputError(f"{path} is a file that {study.path} needs; name another file to write")


def check_two(first: Path, second: Path) -> None:
    """Refuse one place for two files that a command writes."""
    if first.resolve() == second.resolve():
        raise InputError(f"{first} cannot be both of the files to write; name two")


def write_json(path: Path, value: Any) -> None:
    """Write ``value`` as JSON, which has no NaN and no infinity: they become null."""
    write_text(path, json.dumps(_plain(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
