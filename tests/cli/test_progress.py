"""Progress: a bar on a terminal, a line now and then elsewhere, and never a long silence."""

import io

import pytest

from muslin.cli import console
from muslin.cli.console import ProgressView


def test_progress_without_a_terminal_is_a_line_every_few_seconds() -> None:
    stream = io.StringIO()
    with ProgressView(stream) as progress:
        for k in range(1000):
            progress("simulating [1]", k + 1, 1000)
    assert stream.getvalue() == "simulating [1]: 1 of 1000\n"


def test_what_comes_next_does_not_wait_for_the_next_line(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter((0.0, 1.5, 1.6, 1.7, 4.0, 8.9, 9.0))
    monkeypatch.setattr(console.time, "monotonic", lambda: next(clock))
    stream = io.StringIO()
    with ProgressView(stream) as progress:
        for told in (
            ("simulating", 9, 10),
            ("simulating", 10, 10),
            ("polishing", 0, 0),
            ("training", 0, 0),
            ("training", 7, 0),
            ("training", 8, 0),
            ("training", 9, 0),
        ):
            progress(*told)
    assert stream.getvalue().splitlines() == [
        "simulating: 9 of 10",
        "polishing",
        "training: 7 rollouts",
        "training: 9 rollouts",
    ]


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_on_a_terminal_is_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal()
    with ProgressView(stream) as progress:
        progress("simulating [1]", 3, 10)
        progress("training", 0, 0)
    assert "simulating [1]" in stream.getvalue() and "training" in stream.getvalue()
