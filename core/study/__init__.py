"""The study: one file that names everything, one store that holds every result."""

from .config import StudyConfig, parse_config, read_config, write_config
from .pool import Failure, Outcome, SimulationPool, Task
from .problem import Problem, build_problem
from .progress import Progress, silent
from .study import Study

__all__ = [
    "Failure",
    "Outcome",
    "Problem",
    "Progress",
    "SimulationPool",
    "Study",
    "StudyConfig",
    "Task",
    "build_problem",
    "parse_config",
    "read_config",
    "silent",
    "write_config",
]
