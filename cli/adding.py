"""What a study with more effects is called, and the command that writes it."""

from collections.abc import Sequence
from pathlib import Path

from .console import command


def with_effects(study: Path, names: Sequence[str]) -> Path:
    """The file of ``study`` with the effects ``names``, where the user names none."""
    return study.with_name(f"{study.stem}-with-{'-and-'.join(names)}.toml")


def add_command(study: Path, effects: Sequence[str]) -> str:
    """The command line that adds ``effects`` to a study, in :func:`with_effects`."""
    return command("add", ",".join(effects), study)
