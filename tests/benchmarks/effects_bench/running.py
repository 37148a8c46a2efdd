"""One case from beginning to end: simulated, fitted, diagnosed, and shown to the rivals."""

import resource
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from muslin.core.errors import MuslinError
from muslin.core.measurement_store import save_measurement
from muslin.core.study import Study, write_config

from .baselines import BASELINES, Answer, Fitted, make_trial
from .cases import Case
from .generation import Generated, generate


def diagnose_case(case: Case, workers: int) -> dict[str, Any]:
    """What is kept of a case, as JSON. A case that fails says why, and counts as wrong.

    Args:
        case: to run.
        workers: processes of its study.
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
            record |= _diagnosed(_study(made, Path(folder), workers))
    except Exception as error:  # a long run must outlive one case; what failed is counted as wrong
        record["failed"] = f"{type(error).__name__}: {error}"
    return record


def ask_baselines(
    case: Case, record: dict[str, Any], names: Sequence[str], draws: int, cache: Path, workers: int
) -> dict[str, dict[str, Any]]:
    """The answers of baselines, by name, as JSON; they begin with the fit of the case's record.

    Args:
        case: to run.
        record: of the finished case.
        names: of :data:`~.baselines.BASELINES`.
        draws: that the amortised baseline learns from.
        cache: folder for simulations that cases share.
        workers: processes of each.
    """
    answers = {}
    with tempfile.TemporaryDirectory(prefix="muslin-effects-") as folder:
        study = _study(generate(case), Path(folder), workers)
        with make_trial(case, study, Fitted.from_json(record["fitted"]), draws, cache) as trial:
            for name in names:
                began = time.monotonic()
                try:
                    answer = asdict(BASELINES[name](trial))
                except Exception as error:  # see above: that one has no answer
                    answer = asdict(Answer(None)) | {"failed": f"{type(error).__name__}: {error}"}
                answers[name] = answer | {"seconds": round(time.monotonic() - began, 1)}
    return answers


def _study(made: Generated, folder: Path, workers: int) -> Study:
    save_measurement(made.measurement, folder / "recording.zarr")
    write_config(made.config, folder / "study.toml")
    return Study.load(folder / "study.toml", workers=workers)


def _diagnosed(study: Study) -> dict[str, Any]:
    began, processor = time.monotonic(), _processor_seconds()
    fit = study.fit()
    fitted = time.monotonic()
    diagnosis = study.diagnose().to_json()
    return {
        "diagnosis": diagnosis,
        "simulations": fit.simulations + int(diagnosis["simulations"]),
        "seconds": round(time.monotonic() - began, 1),
        "processor_seconds": round(_processor_seconds() - processor, 1),
        "fit_seconds": round(fitted - began, 1),
        "fitted": Fitted.of(study).to_json(),
    }


def _processor_seconds() -> float:
    """Of this process and of those of its workers that have ended; what else the machine does is not in it."""
    mine, theirs = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return mine.ru_utime + mine.ru_stime + theirs.ru_utime + theirs.ru_stime
