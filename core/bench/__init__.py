"""The test bench: virtual tests with closed forms, for any simulator."""

from .bench import TESTS, Report, run_bench
from .case import GOALS, Asked, Case, VirtualTest
from .lab import Lab
from .outcome import Outcome
from .table import lines

__all__ = ["GOALS", "TESTS", "Asked", "Case", "Lab", "Outcome", "Report", "VirtualTest", "lines", "run_bench"]
