"""What a study with one more effect is called, and the commands that write it."""

from collections.abc import Sequence
from pathlib import Path

from .console import command


def with_effect(study: Path, name: str) -> Path:
    """The file of ``study`` with the effect ``name``, where the user names none."""
    return study.with_name(f"{study.stem}-with-{name}.toml")


def add_commands(study: Path, effects: Sequence[str]) -> str:
    """One command line that adds all ``effects``, each to a study of its own that the next one starts from."""
    lines = []
    for name in effects:
        lines.append(command("add", name, study, "-o", with_effect(study, name)))
        study = with_effect(study, name)
    return " && ".join(lines)
