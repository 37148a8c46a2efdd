"""Many rollouts over worker processes; results in order, failures as values."""

import os
import pickle
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from queue import SimpleQueue
from types import TracebackType
from typing import TypeAlias

from threadpoolctl import ThreadpoolController

from ..errors import InputError, MuslinError
from .problem import Problem
from .worker import CannotStart, Failure, Outcome, Task, Worker, simulate

__all__ = ["Failure", "Outcome", "SimulationPool", "Task"]

#: A recording and the values that it is simulated with.
Rollout: TypeAlias = tuple[str, tuple[tuple[str, float], ...]]

_NO_WORKERS = (
    "worker processes cannot start. In a script of your own, put what runs under: if __name__ == '__main__'. "
    "A plugin that was made in a notebook cannot travel to another process: put it into a module, or use workers=1"
)
_HERE = (
    "no worker process can start, so simulations run in this process, where an engine that hangs or crashes cannot "
    "be ended"
)


class SimulationPool:
    """Runs tasks of one problem. The outcome of a task depends on the task alone, not on the workers.

    Nothing that an engine does ends a batch: an exception, a process that dies and a process that hangs beyond
    the problem's time limit all fail one task, and a new process takes the place of the lost one.

    Args:
        problem: sent to every worker once.
        workers: processes; None takes one a core. With 1, a problem that cannot travel to a process (a plugin
            made in a notebook, a script without a main guard) is simulated in this one instead, with a warning.
            0 always does that: no process to wait for, but an engine that hangs or crashes cannot be ended;
            the time limit holds between steps alone.
        watch: called after every rollout.
    """

    def __init__(self, problem: Problem, workers: int | None = None, watch: Callable[[], None] = lambda: None) -> None:
        self.problem = problem
        self.workers = workers if workers is not None else (os.cpu_count() or 1)
        self.count = 0  # rollouts run
        self._watch = watch
        self._played_as = problem.played_as()
        self._threads: ThreadPoolExecutor | None = None
        self._idle: SimpleQueue[Worker | None] = SimpleQueue()  # None: a process yet to be started
        self._busy: set[Worker] = set()
        self._file: str | None = None
        self._accepted = False  # the study has been simulated, well or not, at least once
        self._here: ThreadpoolController | None = None  # of this process, once it is prepared; dear to look up
        self._closed = False

    def __enter__(self) -> "SimulationPool":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closed = True
        if self._threads is not None:
            self._threads.shutdown(wait=False, cancel_futures=True)
            for worker in list(self._busy):  # after an interruption
                worker.kill()
            for _ in range(self.workers):
                idle = self._idle.get()
                if idle is not None:
                    idle.end()
            self._threads = None
        if self._file is not None:
            Path(self._file).unlink(missing_ok=True)
            self._file = None

    def map(self, tasks: Iterable[Task]) -> Iterator[Outcome]:
        """Outcomes in the order of ``tasks``; what several of them ask for is simulated once.

        Raises:
            InputError: every task is refused by muslin or a plugin, and so was every one before: that is not a
                matter of numbers.
            MuslinError: no worker process can start.
        """
        asked = [(self._played_as[t.recording], tuple(sorted(t.values.items()))) for t in tasks]
        once = list(dict.fromkeys(asked))
        self.count += len(once)
        run = self._watched(self._outcomes([Task(dict(values), name) for name, values in once]))
        outcomes = _repeated(asked, run)
        refused: list[Failure] = []
        for outcome in outcomes:
            if not self._accepted and isinstance(outcome, Failure) and outcome.refused:
                refused.append(outcome)
                continue
            self._accepted = True
            yield from refused
            refused = []
            yield outcome
        if refused:
            raise InputError(refused[0].reason)

    def _watched(self, outcomes: Iterator[Outcome]) -> Iterator[Outcome]:
        for outcome in outcomes:
            self._watch()
            yield outcome

    def _outcomes(self, tasks: list[Task]) -> Iterator[Outcome]:
        if self.workers > 0 and tasks:
            try:
                self._start(len(tasks))
            except CannotStart as error:
                if self.workers > 1:
                    raise MuslinError(f"{_NO_WORKERS} ({error})") from error
                warnings.warn(f"{_HERE} ({error})", stacklevel=4)
                self.workers = 0
        if self._threads is None:
            if tasks and self._here is None:
                with ThreadpoolController().limit(limits=1):
                    self.problem.prepare()
                self._here = ThreadpoolController()
            for task in tasks:
                assert self._here is not None
                with self._here.limit(limits=1):  # not across the yield: what the caller does is not ours to limit
                    outcome = simulate(self.problem, task)
                yield outcome
            return
        futures: list[Future[Outcome]] = [self._threads.submit(self._run, t) for t in tasks]
        try:
            for future in futures:
                yield future.result()
        finally:
            for future in futures:
                future.cancel()

    def _start(self, tasks: int) -> None:
        """Start as many workers as there is work for; the others come as they are needed."""
        if self._threads is not None:
            return
        file, now = self._travel(), min(self.workers, tasks)
        threads = ThreadPoolExecutor(self.workers)
        starting = [threads.submit(Worker, file) for _ in range(now)]
        wait(starting)
        failed = next((e for e in (f.exception() for f in starting) if e is not None), None)
        for future in starting:
            if failed is None:
                self._idle.put(future.result())
            elif future.exception() is None:
                future.result().end()
        if failed is not None:
            threads.shutdown()
            raise failed
        for _ in range(self.workers - now):
            self._idle.put(None)
        self._threads = threads

    def _travel(self) -> str:
        """The problem in a file for workers to read."""
        if self._file is None:
            try:
                content = pickle.dumps(self.problem)
            except (pickle.PicklingError, AttributeError, TypeError) as error:
                raise CannotStart(str(error)) from error
            with tempfile.NamedTemporaryFile(prefix="muslin-", suffix=".problem", delete=False) as file:
                file.write(content)
            self._file = file.name
        return self._file

    def _run(self, task: Task) -> Outcome:
        """In a thread of this process: hand the task to a worker and wait for it."""
        worker = self._idle.get()
        try:
            if worker is not None and not worker.alive:  # it died over its last task, or while it was idle
                worker.end()
                worker = None
            if worker is None:
                worker = Worker(self._travel())
            self._busy.add(worker)
            return Failure("interrupted") if self._closed else worker.run(task, self.problem.time_limit)
        finally:
            if worker is not None:
                self._busy.discard(worker)
            self._idle.put(worker)


def _repeated(asked: list[Rollout], once: Iterator[Outcome]) -> Iterator[Outcome]:
    """``once``, in the order of first mention, to everybody who asked; each is kept no longer than somebody waits."""
    waiting, kept = Counter(asked), dict[Rollout, Outcome]()
    for key in asked:
        if key not in kept:
            kept[key] = next(once)
        waiting[key] -= 1
        yield kept[key] if waiting[key] else kept.pop(key)
