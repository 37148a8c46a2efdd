"""Talking to a person: results on standard output, progress and errors on standard error."""

import math
import shlex
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import TextIO

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

#: Time between two lines of progress where there is no terminal, that say the same but for the count, or not [s].
QUIET, BRIEF = 5.0, 1.0


def say(text: str) -> None:
    """A result, or a line about what was done."""
    typer.echo(text)


def command(*parts: object) -> str:
    """A command line that a shell takes as it is printed, whatever a path has in it."""
    return shlex.join(["muslin", *(str(p) for p in parts)])


def add_command(study: Path, effects: Sequence[str]) -> str:
    """The command line that adds ``effects`` to a study."""
    return command("add", ",".join(effects), study)


def next_step(*commands: str, note: str = "") -> None:
    """Name the commands to run next, and what to know before."""
    typer.echo("next: " + "   or: ".join(commands) + (f"   ({note})" if note else ""))


class ProgressView:
    """The progress of a study: a bar on a terminal, a line every few seconds elsewhere.

    An instance is the callback itself, ``(text, done, total)``; total 0 means unknown.

    Args:
        stream: where to show it; default standard error.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream or sys.stderr
        self._bar: Progress | None = None
        self._task: TaskID | None = None
        self._text = ""
        self._shown = -math.inf

    def __enter__(self) -> "ProgressView":
        if self._stream.isatty():
            self._bar = Progress(
                TextColumn("{task.description}", markup=False),
                BarColumn(),
                MofNCompleteColumn(),
                TimeElapsedColumn(),
                console=Console(file=self._stream),
                transient=True,
            )
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def __call__(self, text: str, done: int, total: int) -> None:
        if self._bar is None:
            self._line(text, done, total)
            return
        if self._task is None:
            self._task = self._bar.add_task(text, total=total or None)
        if text != self._text:
            self._bar.reset(self._task, total=total or None, description=text)
            self._text = text
        self._bar.update(self._task, completed=done, total=total or None)

    def _line(self, text: str, done: int, total: int) -> None:
        now = time.monotonic()
        if now - self._shown < (QUIET if text == self._text else BRIEF):
            return
        self._shown, self._text = now, text
        far = f": {done} of {total}" if total else f": {done} rollout{'s' * (done > 1)}" if done else ""
        print(f"{text}{far}", file=self._stream, flush=True)
