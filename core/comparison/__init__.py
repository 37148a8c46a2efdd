"""The same draws on several simulators: where they agree, where they part, and what each is sensitive to."""

from .compare_simulators import compare_simulators
from .result import SimulatorComparison, SimulatorRun

__all__ = ["SimulatorComparison", "SimulatorRun", "compare_simulators"]
