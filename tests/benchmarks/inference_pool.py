"""Cells in processes of their own, so many at a time, each killed when its time is up; what is finished is kept."""

import ast
import hashlib
import json
import multiprocessing as mp
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from importlib.metadata import version
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import NamedTuple

import inference_cell
from inference_cell import RIVALS, Cell, Outcome

import muslin.inference

_ROOMS = ("density", "embedding", "estimators", "posterior")


class Running(NamedTuple):
    cell: Cell
    process: ForkServerProcess
    deadline: float


class Kept:
    """Finished cells in a file, one a line, so that a run that was stopped goes on where it was.

    A cell counts as finished only for the same options, the same versions of the libraries and, for muslin's own,
    the same code of everything an estimator is made of (comments and docstrings aside).
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._code = _code()
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        self._found = {entry["key"]: entry["outcome"] for entry in map(json.loads, lines)}

    def key(self, cell: Cell) -> str:
        made_of = version("sbi") if cell.method in RIVALS else self._code
        return json.dumps([asdict(cell), made_of, version("torch"), version("sbibm"), version("scikit-learn")])

    def get(self, cell: Cell) -> Outcome | None:
        found = self._found.get(self.key(cell))
        return None if found is None else Outcome(**found)

    def add(self, cell: Cell, outcome: Outcome) -> None:
        self._found[self.key(cell)] = asdict(outcome)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"key": self.key(cell), "outcome": asdict(outcome)}) + "\n")


def _code() -> str:
    """Of all modules that estimators are made of, what runs."""
    digest = hashlib.sha256()
    for path in sorted(p for room in _ROOMS for p in (Path(muslin.inference.__path__[0]) / room).rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
                node.body = node.body[1:]
        digest.update(f"{path.name} {ast.dump(tree)}".encode())
    return digest.hexdigest()


def run_all(
    cells: Sequence[Cell], kept: Kept, workers: int, done: Callable[[Cell, Outcome, int], None]
) -> dict[Cell, Outcome]:
    """Outcome of every cell. One over its time is killed, and says so.

    Args:
        cells: in the order in which to start them.
        kept: those that need not run again; new ones are added, but for those that broke.
        workers: processes at a time.
        done: called with each new cell and the number of those still to come.
    """
    outcomes = {cell: found for cell in cells if (found := kept.get(cell)) is not None}
    waiting = [cell for cell in cells if cell not in outcomes]
    running: dict[Connection, Running] = {}
    context = mp.get_context("forkserver")
    context.set_forkserver_preload([inference_cell.__name__])
    while waiting or running:
        while waiting and len(running) < workers:
            cell = waiting.pop(0)
            answer, theirs = context.Pipe(duplex=False)
            process = context.Process(target=inference_cell.work, args=(cell, theirs), daemon=True)
            process.start()
            theirs.close()
            running[answer] = Running(cell, process, time.monotonic() + cell.limit)
        first = min(r.deadline for r in running.values())
        ready = wait(list(running), timeout=max(0.0, first - time.monotonic()))
        late = [a for a, r in running.items() if a not in ready and time.monotonic() >= r.deadline]
        for answer in [*ready, *late]:
            assert isinstance(answer, Connection)
            cell, process, _ = running.pop(answer)
            if answer in late:
                process.kill()
                outcome = Outcome(note=f"over {cell.limit:g} s")
            else:
                outcome = _received(answer)
            process.join()
            outcomes[cell] = outcome
            if outcome.c2st or answer in late:
                kept.add(cell, outcome)
            done(cell, outcome, len(waiting) + len(running))
    return outcomes


def _received(answer: Connection) -> Outcome:
    try:
        return Outcome(**answer.recv())
    except EOFError:
        return Outcome(note="its process died")
