"""Files that commands write: checked before the work starts."""

import json
import math
import os
from pathlib import Path
from typing import Any

from ..core.errors import InputError, MissingFileError
from ..core.store import write_text


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


def write_json(path: Path, value: Any) -> None:
    """Write ``value`` as JSON, which has no NaN and no infinity: they become null."""
    write_text(path, json.dumps(_plain(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
