"""The drape coefficient after Cusick: a round sheet over a smaller disc."""

from functools import partial

import numpy as np

from ..arrays import FloatArray, IntArray
from ..material import ClothMaterial
from ..obstacles import Cylinder
from ..scenario import STANDARD_GRAVITY
from ..scene import Scene
from ..simulator import State
from .case import Asked, Case, VirtualTest
from .lab import Lab
from .meshes import disc

#: Radii of sheet and disc [m] (Cusick, J. Textile Inst. 59 (1968) T253; ISO 9073-9).
SHEET, DISC = 0.15, 0.09
#: The sheet is held under the upper disc within this radius [m], so that the edge of the lower one bends it.
_HELD = 0.075
#: Bending rigidities [N m] at which the sheet is as good as flat, and as good as limp.
STIFF, LIMP = 1e-2, 1e-7
_STIR, _STIR_SHARE, _SEED = 0.2, 0.05, 5
_PIXELS = 400


def shadow(points: FloatArray, triangles: IntArray) -> float:
    """Area [m2] of the shadow of triangles on the ground, counted in pixels; folds that overlap count once."""
    low = points[:, :2].min(axis=0)
    cell = float(np.ptp(points[:, :2], axis=0).max()) / _PIXELS
    corners = (points[triangles][:, :, :2] - low) / cell
    lit = np.zeros((_PIXELS + 1, _PIXELS + 1), np.bool_)
    for a, b, c in corners:
        (i0, j0), (i1, j1) = np.floor(np.min([a, b, c], axis=0)).astype(int), np.max([a, b, c], axis=0).astype(int)
        x, y = np.arange(i0, i1 + 1)[:, None] + 0.5, np.arange(j0, j1 + 1)[None, :] + 0.5
        sides = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) for p, q in ((a, b), (b, c), (c, a))]
        inside = np.all([s >= 0 for s in sides], axis=0) | np.all([s <= 0 for s in sides], axis=0)
        lit[i0 : i1 + 1, j0 : j1 + 1] |= inside[: lit.shape[0] - i0, : lit.shape[1] - j0]
    return float(lit.sum()) * cell**2


def measure(lab: Lab, cells: int, rigidity: float) -> tuple[float]:
    """(shadow - disc) / (sheet - disc): 1 if nothing droops, towards 0 for a limp sheet that hangs straight down.

    A flat round sheet can droop without folds; random forces in the first moments choose folds, the same on
    every engine and for every material.
    """
    body = disc(SHEET, cells)
    material = ClothMaterial(bending_rigidity=rigidity)
    radius = np.hypot(body.vertices[:, 0], body.vertices[:, 1])
    lower = Cylinder(np.array([0.0, 0.0, -0.01]), np.array([0.0, 0.0, 1.0]), DISC, 0.02)
    held = np.flatnonzero(radius < _HELD)
    gravity = np.array([0.0, 0.0, -STANDARD_GRAVITY])
    scene = Scene(body, material, gravity, (held,), np.zeros(len(radius)), (lower,))
    stir = np.random.default_rng(_SEED).normal(0.0, _STIR_SHARE * STANDARD_GRAVITY, len(radius))

    def push(time: float, state: State, masses: FloatArray) -> FloatArray:
        force = np.zeros((len(masses), 3))
        if time < _STIR:
            force[:, 2] = stir * masses
        return force

    pace = np.sqrt(STANDARD_GRAVITY / (SHEET - DISC))
    rest = lab.settle(scene, pace, 5e-4, push, busy=_STIR)
    whole = shadow(body.vertices, body.triangles)
    scale = np.pi * SHEET**2 / whole  # the sheet is a polygon
    return ((shadow(rest, body.triangles) * scale - np.pi * DISC**2) / (np.pi * (SHEET**2 - DISC**2)),)


def cases(quick: bool) -> tuple[Case, ...]:
    """The stiff limit, which must be 1, the fabrics in between, and the limp limit."""
    out = []
    for rigidity in (1e-4,) if quick else (LIMP, 1e-5, 1e-4, STIFF):
        stiff = rigidity == STIFF
        asked = Asked("drape coefficient", "1", 1.0 if stiff else None, 0.05 if stiff else None)
        limit = {LIMP: ", limp limit", STIFF: ", stiff limit"}.get(rigidity, "")
        run = partial(measure, rigidity=rigidity)
        meshes = (5,) if quick else (5, 10, 15)
        out.append(Case("cloth", f"{rigidity:g} N m{limit}", (asked,), meshes, run))
    return tuple(out)


TEST = VirtualTest("drape", "drape", "rings", cases)
