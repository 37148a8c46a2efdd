import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from running import Done, Muslin, cloth_measurement

from muslin.core.measurement_store import save_measurement


@pytest.fixture
def muslin(tmp_path: Path) -> Muslin:
    """The command as a process of its own, in the test's folder."""

    def call(*arguments: str, limit: Callable[[], None] | None = None, **environment: str) -> Done:
        return subprocess.run(
            [sys.executable, "-m", "muslin.cli", *arguments],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=600,
            preexec_fn=limit,
            env={**os.environ, "MUSLIN_DEBUG": "", "COLUMNS": "100", **environment},
        )

    return call


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A study file beside its measurement."""
    save_measurement(cloth_measurement(), tmp_path / "m.zarr")
    path = tmp_path / "study.toml"
    path.write_text(
        '[study]\nmeasurement = "m.zarr"\nhold_out = ["two"]\n'
        '[scenario]\nname = "fling"\nvertices = [3, 3]\n[simulator]\nname = "mujoco"\n'
    )
    return path
