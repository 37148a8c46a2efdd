"""One worker process: it simulates tasks one after the other, and can be ended whatever its engine does."""

import os
import pickle
import signal
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

from threadpoolctl import threadpool_limits

from ..errors import MuslinError, RolloutFailed
from ..rollout import Trajectory
from .problem import Problem

#: Longest time until a worker has loaded its problem and the simulator is prepared [s].
START_LIMIT = 300.0
#: A rollout ends itself at its time limit. One that does not is ended with its process, this much later [s].
GRACE = 1.0


@dataclass(frozen=True)
class Task:
    """One rollout: parameter values and the recording whose motion is simulated."""

    values: Mapping[str, float]
    recording: str


@dataclass(frozen=True)
class Failure:
    """A rollout that did not end well.

    Args:
        reason: for people.
        refused: muslin or a plugin would not even try, as when an effect needs what the simulator cannot do.
    """

    reason: str
    refused: bool = False


Outcome = Trajectory | Failure


def simulate(problem: Problem, task: Task) -> Outcome:
    """One rollout, every error of whatever plugin a value."""
    try:
        return problem.simulate(task.values, task.recording)
    except RolloutFailed as failure:
        return Failure(str(failure))
    except MuslinError as error:
        return Failure(str(error), refused=True)
    except MemoryError:
        return Failure("there was not enough memory")
    except (Exception, SystemExit) as error:  # of an engine, an effect or an extractor by somebody else
        return Failure(f"{type(error).__name__} in a plugin: {str(error) or 'without a text'}")


class CannotStart(MuslinError):
    """A worker process ended, or was refused, before it had loaded its problem."""


class Worker:
    """A process with the problem of ``file`` loaded.

    Args:
        file: pickled problem. Given as an argument it would have to fit into a pipe: Python waits for ever
            when a process dies before it has read all of a larger one, as happens in a script without a
            main guard.

    Raises:
        CannotStart: see there.
        MuslinError: this is the start of a worker process itself, which imports a script without a main guard.
    """

    def __init__(self, file: str) -> None:
        # spawn: a fork of a process with engine or torch threads may hang
        context = get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, file), daemon=True)
        try:
            self._process.start()
        except RuntimeError as error:
            raise MuslinError(f"a worker process cannot start others: {str(error).strip().splitlines()[0]}") from error
        except (AssertionError, OSError) as error:  # a daemon may have no children; out of processes
            raise CannotStart(str(error)) from error
        finally:
            theirs.close()
        if not isinstance(self._receive(START_LIMIT), bool):
            self.end()
            raise CannotStart(f"one ended with {_status(self._process.exitcode)}")

    @property
    def alive(self) -> bool:
        return self._process.is_alive()

    def run(self, task: Task, limit: float | None) -> Outcome:
        """The outcome of ``task``; the process is no longer alive if it ended, or had to be ended, over it.

        Args:
            limit: on its duration [s]; None for none.
        """
        try:
            self._connection.send(task)
        except OSError:
            return self._gone()
        outcome = self._receive(None if limit is None else limit + GRACE)
        if isinstance(outcome, Trajectory | Failure):
            return outcome
        if self.alive and limit is not None:
            self.end()
            return Failure(f"took longer than {limit:g} s and did not stop, so its process was ended")
        return self._gone()

    def kill(self) -> None:
        """End the process; may be called while another thread waits in :meth:`run`, which then returns."""
        self._process.kill()

    def end(self) -> None:
        """End the process and free what it took here."""
        self.kill()
        self._process.join()
        self._connection.close()

    def _receive(self, timeout: float | None) -> object:
        """What the process sends next; None if it ends, or nothing has come after ``timeout`` [s]."""
        try:
            # a process that ends closes its side, which also wakes this up
            return self._connection.recv() if self._connection.poll(timeout) else None
        except (EOFError, OSError):
            self._process.join(GRACE)
            return None

    def _gone(self) -> Failure:
        self.end()
        return Failure(f"the simulator took its process down ({_status(self._process.exitcode)})")


def _status(code: int | None) -> str:
    if code is not None and code < 0:
        return f"signal {signal.Signals(-code).name}"
    return f"exit status {code}"


def _serve(connection: Connection, file: str) -> None:
    """The life of a worker process."""
    try:
        problem: Problem = pickle.loads(Path(file).read_bytes())
    except FileNotFoundError:  # the parent has gone, and another worker took its file away
        os._exit(1)
    # Ctrl-C reaches every process of a terminal; the parent alone ends the work, without tracebacks
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_die_with_parent, args=(os.getppid(), file), daemon=True).start()
    # One thread of linear algebra a process: more only get in each other's way, and the order in which
    # they add up would make results depend on the number of workers.
    with threadpool_limits(1):
        problem.prepare()
        connection.send(True)
        while True:
            try:
                task = connection.recv()
            except (EOFError, ConnectionError):  # the parent has gone
                break
            outcome = simulate(problem, task)
            try:
                connection.send(outcome)
            except ConnectionError:
                break
    Path(file).unlink(missing_ok=True)


def _die_with_parent(parent: int, file: str) -> None:
    """A parent that is killed outright can neither end its workers nor take its ``file`` away; they notice and do."""
    while os.getppid() == parent:
        time.sleep(1.0)
    Path(file).unlink(missing_ok=True)
    os._exit(1)
