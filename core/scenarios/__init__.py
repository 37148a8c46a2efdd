"""Built-in scenarios: an object, how it is held and moved, and what stands around it."""

from .builtin import PRESETS, preset
from .motions import fling_motion, smooth_path, swing_motion
from .preset import SIZES, Preset

__all__ = ["PRESETS", "SIZES", "Preset", "fling_motion", "preset", "smooth_path", "swing_motion"]
