"""A run over many cases that can be stopped and goes on where it was."""

import hashlib
import json
import multiprocessing as mp
import time
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from .cases import Case
from .running import ask_baselines, diagnose_case

BENCH = Path(__file__).resolve().parent
ROOT = BENCH.parents[2]
#: Whose sources a case depends on.
ROOMS = ("core", "backends", "inference", "plugins")
#: What only deals with finished cases.
READERS = ("run.py", "scoring.py", "table.py")


class Kept:
    """What is finished, in a file, one piece a line; of other sources, other keys."""

    def __init__(self, path: Path) -> None:
        self._path = path
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        self._found = {key: record for key, record in map(_line, lines) if key}

    def get(self, *made_of: object) -> dict[str, Any] | None:
        return self._found.get(_key(made_of))

    def add(self, record: dict[str, Any], *made_of: object) -> None:
        self._found[_key(made_of)] = record
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"key": _key(made_of), "record": record}) + "\n")


def _key(made_of: Sequence[object]) -> str:
    return hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()[:24]


def _line(text: str) -> tuple[str, dict[str, Any]]:
    """Key and record; no key of a line that a killed run has left half-written."""
    try:
        read = json.loads(text)
        return str(read["key"]), read["record"]
    except (ValueError, KeyError, TypeError):
        return "", {}


def sources(*, baselines: bool = False) -> str:
    """A hash of all that a finished case depends on, or of what answers of baselines depend on besides."""
    own = {p: p.parent.name == "baselines" for p in BENCH.rglob("*.py")}
    chosen = [p for p, of_baseline in own.items() if of_baseline == baselines and p.name not in READERS]
    if not baselines:
        chosen += [p for room in ROOMS for p in (ROOT / room).rglob("*.py")]
    digest = hashlib.sha256()
    for source in sorted(chosen):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


@dataclass(eq=False)
class Run:
    """What a run does with a case, and where it keeps it.

    Args:
        path: of the file of what is finished.
        cache: folder for simulations that cases share.
        workers: processes of each study.
        baselines: names of those that are asked.
        draws: that the amortised one learns from, a setting.
        made_of, asked_with: hashes of what a diagnosis, and an answer of a baseline, comes from.
    """

    path: Path
    cache: Path
    workers: int
    baselines: tuple[str, ...]
    draws: int
    made_of: str = field(default_factory=sources)
    asked_with: str = field(default_factory=lambda: sources(baselines=True))

    @cached_property
    def kept(self) -> Kept:
        return Kept(self.path)

    def record(self, case: Case) -> dict[str, Any] | None:
        """What is known of a case, with the answers that there are."""
        record = self.kept.get(self.made_of, case.as_dict())
        if record is None:
            return None
        answers = {name: self.kept.get(*self._answer(case, name)) for name in self.baselines}
        return record | {"baselines": {n: a for n, a in answers.items() if a is not None}}

    def _answer(self, case: Case, name: str) -> tuple[object, ...]:
        return self.made_of, self.asked_with, case.as_dict(), name, self.draws

    def finished(self, cases: Sequence[Case], at_once: int, deadline: float) -> Iterator[tuple[int, dict[str, Any]]]:
        """Index and record of the cases that are kept, then of all that is new before ``deadline``, as it ends.

        A case comes once with its diagnosis and once more with what the baselines say.
        """
        yield from [(number, r) for number, case in enumerate(cases) if (r := self.record(case)) is not None]
        left, running = deque(range(len(cases))), dict[Future[dict[str, Any]], int]()
        with ProcessPoolExecutor(at_once, mp_context=mp.get_context("spawn")) as pool:
            while True:
                while left and len(running) < at_once and time.monotonic() < deadline:
                    number = left.popleft()
                    if (future := self._begun(cases[number], pool)) is not None:
                        running[future] = number
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    number = running.pop(future)
                    yield number, self._ended(cases[number], future.result())
                    left.appendleft(number)  # its baselines, if they are still to be asked

    def _begun(self, case: Case, pool: ProcessPoolExecutor) -> Future[dict[str, Any]] | None:
        """The diagnosis of a case, or else the baselines that have not answered; None where nothing is left to do."""
        record = self.record(case)
        if record is None:
            return pool.submit(diagnose_case, case, self.workers)
        missing = [n for n in self.baselines if n not in record["baselines"]]
        if not missing or "fitted" not in record:
            return None
        cache = self.cache / self.made_of
        return pool.submit(ask_baselines, case, record, missing, self.draws, cache, self.workers)

    def _ended(self, case: Case, result: dict[str, Any]) -> dict[str, Any]:
        if self.kept.get(self.made_of, case.as_dict()) is None:
            self.kept.add(result, self.made_of, case.as_dict())
        else:
            for name, answer in result.items():
                self.kept.add(answer, *self._answer(case, name))
        record = self.record(case)
        assert record is not None
        return record
