"""Engines that crash, hang and raise, and workers that cannot start: one clear outcome each, nothing else lost."""

import ctypes
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from next_world import STIFFNESS, register, rope_study

from muslin.backends.mujoco.simulator import MujocoSimulator
from muslin.core.arrays import FloatArray
from muslin.core.effect import Effect, NodalForce
from muslin.core.errors import InputError, MuslinError
from muslin.core.parameters import Parameter
from muslin.core.rollout import Trajectory
from muslin.core.scene import Scene
from muslin.core.study import Failure, SimulationPool, Study, Task
from muslin.core.study.worker import GRACE, CannotStart, Worker
from muslin.plugins.effects.air import AirDrag

VALUES = {"stretch_stiffness": 200.0, "bending_rigidity": 3e-5}


def _sleep_in_c() -> None:
    ctypes.PyDLL(None).sleep(600)  # holds the interpreter lock: nothing inside the process can end it


def _raise() -> None:
    raise ZeroDivisionError("by nothing")


def _no_memory() -> None:
    raise MemoryError


def _refuse() -> None:
    raise InputError("not with these numbers")


HARMS: dict[str, tuple[Callable[[], object], str]] = {
    "kill": (lambda: os.kill(os.getpid(), signal.SIGKILL), "took its process down .signal SIGKILL"),
    "segfault": (lambda: ctypes.string_at(0), "took its process down .signal SIGSEGV"),
    "abort": (os.abort, "took its process down .signal SIGABRT"),
    "exit": (lambda: os._exit(0), "took its process down .exit status 0"),
    "raise": (_raise, "ZeroDivisionError in a plugin: by nothing"),
    "system-exit": (lambda: sys.exit("no licence"), "SystemExit in a plugin: no licence"),
    "memory": (_no_memory, "not enough memory"),
    "hang": (_sleep_in_c, "took longer than 1 s and did not stop, so its process was ended"),
    "refuse": (_refuse, "not with these numbers"),
}


class Harm(Effect):
    """Does what its coefficient, a number in :data:`HARMS`, says, in the third step."""

    name = "harm"
    acts_on = "force"
    coefficients = (Parameter("way", "1", 0.0, 10.0),)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        harm, _ = list(HARMS.values())[round(self.values["way"]) - 1]

        def force(time: float, state: object) -> FloatArray:
            if time > -0.08:
                harm()
            return 0.0 * scene.body.vertices

        return force


def harm(way: str) -> Task:
    return Task({**VALUES, "harm.way": 1.0 + list(HARMS).index(way)}, "near")


def test_a_plugin_that_cannot_travel_is_one_clear_error(small_study: Study) -> None:
    class Local(AirDrag):
        pass

    problem = replace(small_study.problem, effects={"local": Local})
    with SimulationPool(problem, 2) as pool, pytest.raises(MuslinError, match="worker processes cannot start"):
        list(pool.map([Task(VALUES, "near")]))


def test_with_one_worker_a_plugin_that_cannot_travel_is_simulated_here(small_study: Study) -> None:
    class Local(AirDrag):
        pass

    problem = replace(small_study.problem, effects={"local": Local})
    with SimulationPool(problem, 1) as pool, pytest.warns(UserWarning, match="run in this process"):
        (outcome,) = pool.map([Task(VALUES, "near")])
    assert isinstance(outcome, Trajectory)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_an_engine_harms_nothing_but_its_own_task(small_study: Study, workers: int) -> None:
    """Crash, exit, exception and hang between whole rollouts, which come out as they do alone."""
    problem = replace(small_study.problem, effects={"harm": Harm}, time_limit=1.0)
    with SimulationPool(problem, 0) as alone:
        (expected,) = alone.map([Task(VALUES, "near")])
    tasks = [t for way in HARMS for t in (harm(way), Task(VALUES, "near"))]
    with SimulationPool(problem, workers) as pool:
        outcomes = list(pool.map(tasks))
    for (_, words), broken, whole in zip(HARMS.values(), outcomes[::2], outcomes[1::2], strict=True):
        assert isinstance(broken, Failure)
        assert re.search(words, broken.reason)
        assert isinstance(whole, Trajectory) and isinstance(expected, Trajectory)
        assert (whole.vertices == expected.vertices).all()


@pytest.mark.slow
@pytest.mark.parametrize("workers", [0, 2])
def test_takes_of_one_motion_are_simulated_once(small_study: Study, workers: int) -> None:
    problem = small_study.problem
    again = {**problem.scenarios, "near-again": replace(problem.scenarios["near"])}
    with SimulationPool(replace(problem, scenarios=again), workers) as pool:
        assert pool.problem.played_as() == {**{n: n for n in problem.scenarios}, "near-again": "near"}
        other = {**VALUES, "stretch_stiffness": 300.0}
        tasks = [Task(VALUES, "near"), Task(other, "near-again"), Task(VALUES, "far"), Task(VALUES, "near-again")]
        first, stiffer, far, second = pool.map([*tasks])
        assert pool.count == 3
    assert isinstance(first, Trajectory) and isinstance(far, Trajectory) and isinstance(stiffer, Trajectory)
    assert second is first
    assert not np.array_equal(first.series.points, stiffer.series.points)
    assert not np.array_equal(first.series.points, far.series.points)


def test_a_hang_costs_its_time_limit_and_no_more(small_study: Study) -> None:
    problem = replace(small_study.problem, effects={"harm": Harm}, time_limit=1.0)
    with SimulationPool(problem, 1) as pool:
        list(pool.map([Task(VALUES, "near")]))  # the process has started
        began = time.monotonic()
        list(pool.map([harm("hang")]))
        took = time.monotonic() - began
    assert 1.0 <= took < 1.0 + GRACE + 1.0


class SlowToPrepare(MujocoSimulator):
    """Compiles for a while in every process, and then says that it could not."""

    def prepare(self, scene: Scene) -> None:
        time.sleep(3.0)
        raise RuntimeError("no compiler")


@pytest.mark.parametrize("workers", [0, 1])
def test_what_a_simulator_does_once_in_a_process_is_not_counted(small_study: Study, workers: int) -> None:
    problem = replace(small_study.problem, simulator=SlowToPrepare(), time_limit=1.5)
    began = time.monotonic()
    with SimulationPool(problem, workers) as pool:
        outcomes = [*pool.map([Task(VALUES, "near")]), *pool.map([Task(VALUES, "near")])]
    assert all(isinstance(o, Trajectory) for o in outcomes)
    assert time.monotonic() - began > 3.0


def test_between_steps_the_time_limit_holds_in_this_process_too(small_study: Study) -> None:
    with SimulationPool(replace(small_study.problem, time_limit=1e-4), 0) as pool:
        (outcome,) = pool.map([Task(VALUES, "near")])
    assert isinstance(outcome, Failure)
    assert "took longer than 0.0001 s" in outcome.reason


def test_what_is_refused_every_time_is_an_error_and_not_a_failed_draw(small_study: Study) -> None:
    problem = replace(small_study.problem, effects={"harm": Harm})
    refused, whole = harm("refuse"), Task(VALUES, "near")
    with SimulationPool(problem, 0) as pool, pytest.raises(InputError, match="not with these numbers"):
        list(pool.map([refused, refused]))
    with SimulationPool(problem, 0) as pool:
        first, second, third = pool.map([refused, whole, refused])
        (fourth,) = pool.map([refused])
    assert isinstance(second, Trajectory)
    assert first == third == fourth == Failure("not with these numbers", refused=True)


@pytest.mark.slow
def test_a_worker_that_dies_while_idle_is_replaced(small_study: Study) -> None:
    with SimulationPool(small_study.problem, 1) as pool:
        (before,) = pool.map([Task(VALUES, "near")])
        worker = pool._idle.get()
        assert worker is not None
        worker.kill()
        worker._process.join()
        pool._idle.put(worker)
        (after,) = pool.map([Task(VALUES, "near")])
    assert isinstance(before, Trajectory) and isinstance(after, Trajectory)


def test_a_worker_whose_file_was_taken_away_ends_quietly(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """As of a command that was killed while its workers were starting: the first of them takes it away."""
    with pytest.raises(CannotStart, match="one ended with exit status 1"):
        Worker(str(tmp_path / "gone.problem"))
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.slow
def test_leaving_early_ends_the_workers(small_study: Study) -> None:
    problem = replace(small_study.problem, effects={"harm": Harm}, time_limit=60.0)
    began = time.monotonic()
    with SimulationPool(problem, 2) as pool:
        outcomes = pool.map([Task(VALUES, "near"), harm("hang"), harm("hang")])
        next(outcomes)
        workers = list(pool._busy)
    assert time.monotonic() - began < 30.0
    assert workers
    assert not any(w.alive for w in workers)


@pytest.mark.slow
def test_a_script_without_a_main_guard_ends_with_an_error(small_study: Study) -> None:
    script = small_study.path.with_name("script.py")
    script.write_text(f"from muslin import Study\nStudy.load({str(small_study.path)!r}, workers=2).fit()\n")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=120, cwd=Path.home())
    assert done.returncode != 0
    assert "if __name__ == '__main__'" in done.stderr


def test_a_search_of_unknown_length_counts_its_rollouts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    register(monkeypatch)
    study, heard = rope_study(tmp_path), list[tuple[str, int, int]]()
    study.progress = lambda *told: heard.append(told)
    tasks = [Task({"stretch_stiffness": STIFFNESS + k}, "slow") for k in range(2)]
    with study.pool() as pool:
        study.progress("polishing", 0, 0)
        list(pool.map(tasks))
        study.progress("simulating", 1, 2)  # counts for itself
        list(pool.map(tasks))
    assert heard == [("polishing", 0, 0), ("polishing", 1, 0), ("polishing", 2, 0), ("simulating", 1, 2)]
