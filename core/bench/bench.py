"""The test bench: every virtual test on one simulator."""

import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..errors import InputError, RolloutFailed
from ..registry import nearest
from ..simulator import CAPABILITIES, Simulator
from ..version import __version__
from . import bending, drape, falling, friction, rope, sagging, stretch, swinging
from .case import Case, VirtualTest
from .lab import Lab
from .outcome import Outcome, summary

#: Every virtual test by name, in the order of the report.
TESTS: dict[str, VirtualTest] = {
    t.name: t
    for t in (
        stretch.TEST,
        bending.TEST,
        rope.TWIST,
        drape.TEST,
        friction.TEST,
        rope.CAPSTAN,
        falling.FREE,
        falling.AIR,
        swinging.PENDULUM,
        swinging.CHAIN,
        swinging.VIBRATION,
        sagging.TEST,
    )
}
#: Seconds of this process that one run on one mesh may take, and all together; quick and full.
TIME_LIMITS, BUDGETS = (4.0, 20.0), (55.0, 420.0)
#: A run may take this many times its even share of what is left of the budget, and this much in any case [s].
_SHARES, _LEAST = 2.0, 0.5


@dataclass(frozen=True)
class Report:
    """What the bench found.

    Args:
        simulator: its name.
        engine: name and version of the engine.
        machine: on which it ran.
        quick: whether only few cases were run.
        outcomes: one a quantity and case.
        seconds: of this process that it took.
    """

    simulator: str
    engine: str
    machine: str
    quick: bool
    outcomes: list[Outcome] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def summary(self) -> str:
        return summary(self.outcomes)

    def to_json(self) -> dict[str, object]:
        """For ``results/``."""
        return {
            "simulator": self.simulator,
            "engine": self.engine,
            "muslin": __version__,
            "machine": self.machine,
            "quick": self.quick,
            "seconds": round(self.seconds, 1),
            "summary": self.summary,
            "rows": [o.to_json() for o in self.outcomes],
        }


def run_bench(
    simulator: Simulator,
    tests: Sequence[str] = (),
    quick: bool = True,
    tell: Callable[[str, int, int], None] | None = None,
    time_limit: float | None = None,
) -> Report:
    """Run virtual tests. What a simulator refuses or fails at is reported and never ends the bench.

    Args:
        simulator: under test.
        tests: names out of :data:`TESTS`; none means all.
        quick: few cases on coarse meshes.
        tell: called before every case with its name, how many are done, and how many there are.
        time_limit: seconds of this process for one run on one mesh; default :data:`TIME_LIMITS`, and less
            where :data:`BUDGETS` is running out.

    Raises:
        InputError: there is no test of that name.
    """
    for name in tests:
        if name not in TESTS:
            raise InputError(
                f"there is no virtual test {name!r}.{nearest(name, list(TESTS))} They are {', '.join(TESTS)}"
            )
    which = 0 if quick else 1
    planned = [(TESTS[name], case) for name in tests or TESTS for case in TESTS[name].cases(quick)]
    outcomes: list[Outcome] = []
    began = time.process_time()
    for k, (test, case) in enumerate(planned):
        left = BUDGETS[which] - (time.process_time() - began)
        share = max(_LEAST, min(TIME_LIMITS[which], _SHARES * left / (len(planned) - k)))
        if tell is not None:
            tell(f"{test.name}, {case.kind}, {case.label}", k, len(planned))
        outcomes += _run(Lab(simulator, share if time_limit is None else time_limit), test, case)
    seconds = time.process_time() - began
    return Report(simulator.name, simulator.engine_version(), machine(), quick, outcomes, seconds)


def _run(lab: Lab, test: VirtualTest, case: Case) -> list[Outcome]:
    """One outcome for every quantity of a case. A mesh that fails ends it: finer ones ask for more."""
    simulator = lab.simulator
    meshes: list[int] = []
    seconds: list[float] = []
    values: list[tuple[float, ...]] = []
    reason, claimed = "", True
    missing = [CAPABILITIES[c] for c in sorted(case.needs - simulator.capabilities)]
    if missing and case.kind in simulator.object_kinds:
        reason, claimed = f"simulator {simulator.name!r} cannot {' or '.join(missing)}", False
    for cells in case.meshes if claimed else ():
        began = time.process_time()
        try:
            found = case.measure(lab, cells)
            if not np.isfinite(found).all():
                raise RolloutFailed("the result is not finite")
        except InputError as error:
            reason, claimed = str(error), bool(values)
        except RolloutFailed as error:
            reason = str(error)
        except Exception as error:  # a third party's simulator may raise anything
            reason = f"{type(error).__name__}: {error}"
        else:
            meshes.append(cells)
            values.append(found)
            seconds.append(round(time.process_time() - began, 3))
            continue
        reason = f"{cells} cells: {reason}" if claimed else reason
        break
    return [
        Outcome(
            test.name,
            test.group,
            case.kind,
            case.label,
            asked.quantity,
            asked.unit,
            asked.value,
            asked.goal,
            test.cells,
            meshes,
            [float(f"{v[k]:.6g}") for v in values],
            seconds,
            reason,
            claimed,
        )
        for k, asked in enumerate(case.asked)
    ]


def machine() -> str:
    """Processor and the cores that this process may use."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{model}, {cores} cores, Python {platform.python_version()}"
