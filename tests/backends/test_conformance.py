"""Both engines pass the kit that third parties use."""

from functools import partial

import pytest
from engine_runs import ENGINES, simulator

from muslin.core.testing import check_simulator


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_simulator(engine: str) -> None:
    check_simulator(partial(simulator, engine))
