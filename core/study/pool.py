"""Many rollouts over worker processes; results in order, failures as values."""

import os
import pickle
import signal
import tempfile
import threading
import time
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from types import TracebackType

from threadpoolctl import threadpool_limits

from ..errors import MuslinError, RolloutFailed
from ..rollout import Trajectory
from .problem import Problem


@dataclass(frozen=True)
class Task:
    """One rollout: parameter values and the recording whose motion is simulated."""

    values: Mapping[str, float]
    recording: str


@dataclass(frozen=True)
class Failure:
    """A rollout that did not end well, and why."""

    reason: str


Outcome = Trajectory | Failure

_PROBLEM: Problem | None = None


def _start_worker(file: str) -> None:
    global _PROBLEM
    _PROBLEM = pickle.loads(Path(file).read_bytes())
    # Ctrl-C reaches every process of a terminal; the parent alone ends the work, without tracebacks
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # One thread of linear algebra a process: more only get in each other's way, and the order in which
    # they add up would make results depend on the number of workers.
    threadpool_limits(1)
    threading.Thread(target=_die_with_parent, args=(os.getppid(),), daemon=True).start()


def _die_with_parent(parent: int) -> None:
    """A parent that is killed outright cannot end its workers; they notice and end themselves."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


def _run(problem: Problem, task: Task) -> Outcome:
    try:
        return problem.simulate(task.values, task.recording)
    except RolloutFailed as failure:
        return Failure(str(failure))


def _run_in_worker(task: Task) -> Outcome:
    assert _PROBLEM is not None
    return _run(_PROBLEM, task)


def _ready() -> bool:
    return _PROBLEM is not None


_NO_WORKERS = (
    "worker processes cannot start. In a script of your own, put what runs under: if __name__ == '__main__'. "
    "A plugin that was made in a notebook cannot travel to another process: put it into a module, or use workers=1"
)


def _executor(workers: int, file: str) -> ProcessPoolExecutor:
    # spawn: a fork of a process with engine or torch threads may hang
    return ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_start_worker, initargs=(file,))


class SimulationPool:
    """Runs tasks of one problem. The outcome of a task depends on the task alone, not on the workers.

    Args:
        problem: sent to every worker once.
        workers: processes; 1 runs in this process; None takes one a core.
    """

    def __init__(self, problem: Problem, workers: int | None = None) -> None:
        self.problem = problem
        self.workers = workers if workers is not None else (os.cpu_count() or 1)
        self.count = 0  # rollouts run
        self._executor: ProcessPoolExecutor | None = None
        self._file: str | None = None

    def __enter__(self) -> "SimulationPool":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._executor is not None:
            self._executor.shutdown(wait=True, cancel_futures=True)
            self._executor = None
        if self._file is not None:
            Path(self._file).unlink(missing_ok=True)
            self._file = None

    def _travel(self) -> str:
        """The problem in a file for workers to read.

        Given as an argument it would have to fit into a pipe: Python waits for ever when a process dies
        before it has read all of a larger one, as happens in a script without a main guard.
        """
        if self._file is None:
            try:
                content = pickle.dumps(self.problem)
            except (pickle.PicklingError, AttributeError, TypeError) as error:
                raise MuslinError(f"{_NO_WORKERS} ({error})") from error
            with tempfile.NamedTemporaryFile(prefix="muslin-", suffix=".problem", delete=False) as file:
                file.write(content)
            self._file = file.name
        return self._file

    def _open(self) -> ProcessPoolExecutor:
        if self._executor is None:
            self._executor = _executor(self.workers, self._travel())
        return self._executor

    def map(self, tasks: Iterable[Task]) -> Iterator[Outcome]:
        """Outcomes in the order of ``tasks``. A worker that dies fails its task and is replaced."""
        tasks = list(tasks)
        self.count += len(tasks)
        if self.workers == 1:
            for task in tasks:
                with threadpool_limits(1):  # not across the yield: what the caller does is not ours to limit
                    outcome = _run(self.problem, task)
                yield outcome
            return
        futures: list[Future[Outcome]] = [self._submit(t) for t in tasks]
        for k, future in enumerate(futures):
            try:
                yield future.result()
            except BrokenProcessPool:
                yield self._alone(tasks[k])
                # whatever was queued behind the broken pool goes to a new one
                for j in range(k + 1, len(tasks)):
                    if not (futures[j].done() and futures[j].exception() is None):
                        futures[j] = self._submit(tasks[j])

    def _submit(self, task: Task) -> Future[Outcome]:
        try:
            return self._open().submit(_run_in_worker, task)
        except BrokenProcessPool:  # a worker died while the pool was idle
            self._drop()
            return self._open().submit(_run_in_worker, task)

    def _drop(self) -> None:
        if self._executor is not None:
            self._executor.shutdown(wait=False, cancel_futures=True)
            self._executor = None

    def _alone(self, task: Task) -> Outcome:
        """Run a task that was in a pool that broke in a process of its own, to learn whether it was the cause.

        Raises:
            MuslinError: no worker process can start at all.
        """
        self._drop()
        executor = _executor(1, self._travel())
        try:
            try:
                executor.submit(_ready).result()
            except BrokenProcessPool as error:
                raise MuslinError(_NO_WORKERS) from error
            try:
                return executor.submit(_run_in_worker, task).result()
            except BrokenProcessPool:
                return Failure("the simulator took its process down")
        finally:
            executor.shutdown(wait=False, cancel_futures=True)
