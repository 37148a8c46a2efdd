"""Conformance kits for plugins. They need no test framework: a check raises AssertionError with a sentence.

::

    from muslin.core.testing import check_simulator

    def test_my_simulator():
        check_simulator(MySimulator)
"""

from .datasets import check_dataset
from .effects import check_effect
from .estimators import check_estimator
from .extractors import check_extractor
from .kits import KITS, run_checks
from .renderers import check_renderer
from .simulators import check_simulator

__all__ = [
    "KITS",
    "check_dataset",
    "check_effect",
    "check_estimator",
    "check_extractor",
    "check_renderer",
    "check_simulator",
    "run_checks",
]
