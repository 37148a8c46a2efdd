"""Where the next recording starts from: as the old ones were held, and at rest."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy")
pytest.importorskip("torch")

from next_world import register, rope_study
from test_next import propose, tied_drags

from muslin.core.scenario import StartMotion


def test_a_new_recording_starts_at_rest_though_the_old_ones_did_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    register(monkeypatch)
    study = rope_study(tmp_path)
    tied_drags(study)
    problem, told = study.problem, []
    for moving in (None, StartMotion(np.ones((5, 3)), np.zeros((5, 3)))):
        scenarios = {"slow": replace(problem.scenarios["slow"], start_motion=moving)}
        study.__dict__["problem"] = replace(problem, scenarios=scenarios)
        told.append({**propose(study, simulations=30).result, "seconds": 0})
    assert told[0] == told[1]
