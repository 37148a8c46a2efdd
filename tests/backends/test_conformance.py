"""Both engines pass the kit that third parties use."""

import pytest
from engine_runs import ENGINES, simulator

from muslin.core.testing import check_simulator


@pytest.mark.parametrize("engine", ENGINES)
def test_simulator(engine: str) -> None:
    check_simulator(lambda: simulator(engine))
