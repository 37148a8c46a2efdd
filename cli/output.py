"""Files that commands write: checked before the work starts, and whole or absent."""

import os
from pathlib import Path

from ..core.errors import InputError, MissingFileError
from ..core.store import storage_errors


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


def write_whole(path: Path, text: str) -> None:
    """Write a text file beside its place and move it there, so that a full disk leaves nothing."""
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    with storage_errors(path):
        try:
            partial.write_text(text, encoding="utf-8")
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
