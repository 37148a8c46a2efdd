"""One case from beginning to end: simulated, fitted, diagnosed, and shown to the rivals."""

import resource
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from muslin.core.errors import MuslinError
from muslin.core.measurement_store import save_measurement
from muslin.core.study import Study, write_config

from .baselines import BASELINES, make_trial
from .cases import Case
from .generation import Generated, generate


@dataclass(frozen=True)
class Plan:
    """How cases are run.

    Args:
        workers: processes of a study.
        baselines: names of :data:`~.baselines.BASELINES`.
        draws: that the amortised baseline learns from.
    """

    workers: int
    baselines: tuple[str, ...]
    draws: int


def run_case(case: Case, plan: Plan, cache: Path) -> dict[str, Any]:
    """What is kept of a case, as JSON. A case that fails says why, and counts as wrong.

    Args:
        case: to run.
        plan: how.
        cache: folder for simulations that cases share.
    """
    record: dict[str, Any] = {"case": case.as_dict(), "failed": None}
    began = time.monotonic()
    try:
        made = generate(case)
        record["truth"] = asdict(made.truth)
        record["generation_seconds"] = round(time.monotonic() - began, 1)
    except MuslinError as error:
        return record | {"left_out": str(error)}  # nothing to diagnose: no method has failed
    try:
        with tempfile.TemporaryDirectory(prefix="muslin-effects-") as folder:
            record |= _judged(case, made, plan, cache, Path(folder))
    except Exception as error:  # a long run must outlive one case; what failed is counted as wrong
        record["failed"] = f"{type(error).__name__}: {error}"
    return record


def _judged(case: Case, made: Generated, plan: Plan, cache: Path, folder: Path) -> dict[str, Any]:
    save_measurement(made.measurement, folder / "recording.zarr")
    write_config(made.config, folder / "study.toml")
    study = Study.load(folder / "study.toml", workers=plan.workers)
    began, processor = time.monotonic(), _processor_seconds()
    fit = study.fit()
    fitted = time.monotonic()
    diagnosis = study.diagnose().to_json()
    out: dict[str, Any] = {
        "diagnosis": diagnosis,
        "simulations": fit.simulations + int(diagnosis["simulations"]),
        "seconds": round(time.monotonic() - began, 1),
        "processor_seconds": round(_processor_seconds() - processor, 1),
        "fit_seconds": round(fitted - began, 1),
        "baselines": {},
    }
    if plan.baselines:
        with make_trial(case, study, plan.draws, cache) as trial:
            for name in plan.baselines:
                began = time.monotonic()
                answer = BASELINES[name](trial)
                out["baselines"][name] = asdict(answer) | {"seconds": round(time.monotonic() - began, 1)}
    return out


def _processor_seconds() -> float:
    """Of this process and of those of its workers that have ended; what else the machine does is not in it."""
    mine, theirs = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return mine.ru_utime + mine.ru_stime + theirs.ru_utime + theirs.ru_stime
