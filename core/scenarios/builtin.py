"""The built-in scenarios."""

from collections.abc import Callable

import numpy as np

from ..arrays import IntArray
from ..body import Body
from ..errors import InputError
from ..motion import Motion
from ..obstacles import Cylinder, Table
from ..parameters import Parameter
from ..registry import nearest
from . import grasps, layouts, motions, starts
from .preset import Preset

#: Thick, stiff cloth, as a folded towel or felt: beyond the range of fabrics that are worn.
_THICK = {"areal_density": 0.5, "bending_rigidity": 5e-4, "stretch_stiffness": 2000.0}
_THICK_PRIORS = (
    Parameter("stretch_stiffness", "N/m", 200.0, 20000.0, "log", "Young's modulus times thickness"),
    Parameter("bending_rigidity", "N m", 2e-5, 1e-2, "log", "moment per length and curvature"),
    Parameter("friction", "1", 0.1, 1.0, "linear", "Coulomb coefficient on an obstacle of friction 1"),
)
#: A soft line of 6 mm: it lies round a thumb without springing off.
_SOFT_LINE = {
    "linear_density": 0.03,
    "stretch_stiffness": 300.0,
    "bending_rigidity": 1e-5,
    "twist_rigidity": 1e-5,
    "diameter": 0.006,
}
_SOFT_LINE_PRIORS = (
    Parameter("bending_rigidity", "N m2", 1e-6, 1e-3, "log", "moment per curvature"),
    Parameter("stretch_stiffness", "N", 50.0, 5000.0, "log", "Young's modulus times cross-section"),
    Parameter("friction", "1", 0.1, 1.0, "linear", "Coulomb coefficient on an obstacle of friction 1"),
)
_SPOOL = Cylinder(np.array([0.0, 0.0, motions.SPOOL_HEIGHT]), np.array([0.0, 1.0, 0.0]), motions.SPOOL_RADIUS, 0.3)
#: So far below the gripper that level cloth starts on it, a millimetre above.
_TABLE = Table(0.0)


def _always(motion: Callable[[], Motion]) -> Callable[[Body], Motion]:
    return lambda body: motion()


def _in_the_air(
    name: str,
    about: str,
    motion: Callable[[], Motion],
    holds: Callable[[Body], tuple[IntArray, ...]],
    settle: float = 0.5,
) -> Preset:
    kinds, path = ("cloth", "rope"), _always(motion)
    return Preset(name, about, kinds, (0.3, 0.3), (9, 9), path, holds, layouts.hanging, settle=settle)


PRESETS: dict[str, Preset] = {
    p.name: p
    for p in (
        _in_the_air(
            "fling",
            "cloth by its top corners, or rope by one end, in the air: flung up and forward",
            motions.fling_motion,
            grasps.top_corners,
        ),
        _in_the_air("swing", "the same, swung to and fro", motions.swing_motion, grasps.top_corners),
        _in_the_air("lift", "the same, lifted", motions.lift_motion, grasps.top_corners),
        _in_the_air("hang", "the same, held still", motions.still_motion, grasps.top_corners, settle=0.0),
        _in_the_air(
            "carry",
            "cloth by its top edge, or rope by one end, in the air: carried elsewhere",
            motions.carry_motion,
            grasps.top_edge,
        ),
        _in_the_air("drop", "cloth or rope that nobody holds", motions.still_motion, grasps.nothing_held, settle=0.0),
        Preset(
            "fold",
            "cloth that lies on a table, folded over by two corners",
            ("cloth",),
            (0.3, 0.3),
            (9, 9),
            motions.fold_motion,
            grasps.top_corners,
            layouts.level,
            settle=0.3,
            obstacles=(_TABLE,),
        ),
        Preset(
            "wiping",
            "cloth that lies on a table, drawn over it by the middle of an edge",
            ("cloth",),
            (0.3, 0.3),
            (9, 9),
            motions.wiping_motion,
            grasps.middle_of_edge,
            layouts.level,
            settle=0.3,
            obstacles=(_TABLE,),
            material=_THICK,
            priors=_THICK_PRIORS,
        ),
        Preset(
            "cable",
            "rope in the air, clamped at both ends by two grippers",
            ("rope",),
            (1.0,),
            (41,),
            motions.cable_motion,
            grasps.clamped_ends,
            layouts.ahead,
            settle=0.5,
            start=starts.sagging,
        ),
        Preset(
            "winding",
            "rope clamped at one end and wound onto a spool",
            ("rope",),
            (1.0,),
            (51,),
            motions.winding_motion,
            grasps.clamped_start,
            layouts.behind,
            settle=0.5,
            obstacles=(_SPOOL,),
            start=starts.draped,
            material=_SOFT_LINE,
            priors=_SOFT_LINE_PRIORS,
        ),
        Preset(
            "beam",
            "soft solid, clamped at one end",
            ("solid",),
            (0.03, 0.10, 0.03),
            (3, 7, 3),
            _always(Motion.still),
            grasps.low_y_face,
            layouts.silicone_beam,
            load_vertices=grasps.high_y_face,
        ),
    )
}


def preset(name: str) -> Preset:
    """A built-in scenario by name."""
    if name not in PRESETS:
        raise InputError(f"there is no scenario {name!r}.{nearest(name, list(PRESETS))} Built in: {', '.join(PRESETS)}")
    return PRESETS[name]
