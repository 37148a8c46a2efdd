"""Worker processes that die, cannot start, or were never asked to: one clear outcome each."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from muslin.core.errors import MuslinError
from muslin.core.rollout import Trajectory
from muslin.core.study import Failure, SimulationPool, Study, Task
from muslin.plugins.effects.air import AirDrag

VALUES = {"stretch_stiffness": 200.0, "bending_rigidity": 3e-5}


class Deadly(AirDrag):
    """Takes its process down, as an engine may."""

    name = "deadly"

    def on_gravity(self, gravity):  # type: ignore[no-untyped-def]
        os.kill(os.getpid(), signal.SIGKILL)


def test_a_plugin_that_cannot_travel_is_one_clear_error(small_study: Study) -> None:
    class Local(AirDrag):
        pass

    problem = replace(small_study.problem, effects={"local": Local})
    with SimulationPool(problem, 2) as pool, pytest.raises(MuslinError, match="worker processes cannot start"):
        list(pool.map([Task(VALUES, "near")]))


@pytest.mark.slow
def test_a_rollout_that_kills_its_process_fails_alone(small_study: Study) -> None:
    problem = replace(small_study.problem, effects={"deadly": Deadly})
    tasks = [Task(VALUES, "near"), Task({**VALUES, "deadly.drag_coefficient": 1.0}, "near"), Task(VALUES, "far")]
    with SimulationPool(problem, 2) as pool:
        first, second, third = pool.map(tasks)
    assert isinstance(first, Trajectory) and isinstance(third, Trajectory)
    assert second == Failure("the simulator took its process down")


@pytest.mark.slow
def test_a_worker_that_dies_while_idle_is_replaced(small_study: Study) -> None:
    with SimulationPool(small_study.problem, 1 + 1) as pool:
        (before,) = pool.map([Task(VALUES, "near")])
        assert pool._executor is not None
        for process in list(pool._executor._processes.values()):
            os.kill(process.pid, signal.SIGKILL)
            process.join()
        (after,) = pool.map([Task(VALUES, "near")])
    assert isinstance(before, Trajectory) and isinstance(after, Trajectory)


@pytest.mark.slow
def test_a_script_without_a_main_guard_ends_with_an_error(small_study: Study) -> None:
    script = small_study.path.with_name("script.py")
    script.write_text(f"from muslin import Study\nStudy.load({str(small_study.path)!r}, workers=2).fit()\n")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=60, cwd=Path.home())
    assert done.returncode != 0
    assert "if __name__ == '__main__'" in done.stderr
