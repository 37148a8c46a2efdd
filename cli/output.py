"""Files that commands write: checked before the work starts."""

import os
from pathlib import Path

from ..core.errors import InputError, MissingFileError


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
