"""muslin: make simulators of cloth and soft solids match reality.

Fit a simulator to a recording, see where it fails, learn which physical effect is missing, add it.
"""

from .core.effect import Effect
from .core.errors import MuslinError
from .core.measurement import Measurement, Recording
from .core.registry import register
from .core.series import PointSeries
from .core.study import Study
from .core.version import __version__

__all__ = [
    "Effect",
    "Measurement",
    "MuslinError",
    "PointSeries",
    "Recording",
    "Study",
    "__version__",
    "register",
]
