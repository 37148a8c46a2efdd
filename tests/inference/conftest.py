"""Fixtures of the inference tests."""

from pathlib import Path

import pytest
from small import small_measurement, write_study

from muslin.core.study import Study


@pytest.fixture
def small_study(tmp_path: Path) -> Study:
    pytest.importorskip("mujoco")
    return Study.load(write_study(tmp_path, small_measurement()), workers=0)
