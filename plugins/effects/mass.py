"""Mass that is not spread evenly: a hem, a wet patch."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.body import Body
from ...core.effect import Effect
from ...core.material import Material
from ...core.parameters import Parameter

#: A rest shape lies level if it is less high than this share of its size [1].
LEVEL_TO = 0.1


class Hem(Effect):
    """A rim heavier than the rest: extra mass along every edge that only one triangle has, holes included.

    A hem folded twice carries two extra layers: 2 rho w for a width w, 6 g/m at 0.15 kg/m2 and 20 mm, with a
    seam or a cord more. The stiffness of the fold is left out.
    """

    name: ClassVar[str] = "hem"
    acts_on: ClassVar[str] = "mass"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("line_mass", "kg/m", 0.0, 0.03, description="extra mass along the rim"),
    )
    symptom: ClassVar[str] = "has a rim that swings wider and settles later than the light rim of the model"

    def on_loads(self, body: Body, material: Material, loads: FloatArray) -> FloatArray:
        rim = boundary_edges(body)
        lengths = np.linalg.norm(body.vertices[rim[:, 1]] - body.vertices[rim[:, 0]], axis=1)
        share = np.repeat(0.5 * self.values["line_mass"] * lengths, 2)
        return loads + np.bincount(rim.ravel(), share, minlength=len(loads))


class WetPatch(Effect):
    """Water in the lowest part of the object: where it is wet its density is 1 + uptake times the dry one.

    Wet is what lies below a share of the height of the rest shape, along z of its own frame; of a rest shape that lies
    level (to :data:`LEVEL_TO`), along y, and of one that lies along x, along x. Textiles take up 50 to 150 % of their
    mass. Only the mass of the water counts, not how it softens the yarns or holds the cloth to what it touches
    (:class:`~.adhesion.Adhesion`).
    """

    name: ClassVar[str] = "wet-patch"
    acts_on: ClassVar[str] = "mass"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "rope"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("uptake", "1", 0.0, 2.0, description="mass of water over dry mass, where it is wet"),
        Parameter("extent", "1", 0.0, 1.0, description="share of the height that is wet, from below"),
    )
    symptom: ClassVar[str] = "is heavier in its lower part than in the model"

    def on_loads(self, body: Body, material: Material, loads: FloatArray) -> FloatArray:
        extents = np.ptp(body.vertices, axis=0)
        upright = next(axis for axis in (2, 1, 0) if extents[axis] > LEVEL_TO * extents.max())
        height = body.vertices[:, upright]
        level = height.min() + self.values["extent"] * np.ptp(height)
        corners = body.elements.shape[1]
        wet = share_below(height[body.elements], float(level)) * body.measures * material.density
        water = np.repeat(self.values["uptake"] * wet / corners, corners)
        return loads + np.bincount(body.elements.ravel(), water, minlength=len(loads))


def boundary_edges(body: Body) -> IntArray:
    """Edges ``(B, 2)`` that belong to one triangle only."""
    sides = np.sort(body.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, uses = np.unique(sides, axis=0, return_counts=True)
    return np.asarray(edges[uses == 1])


def share_below(heights: FloatArray, level: float) -> FloatArray:
    """Share ``(E,)`` of segments or triangles with corners at ``heights (E, 2 or 3)`` [m] that lies below ``level``."""
    h = np.sort(heights, axis=1)
    low, high = h[:, 0], h[:, -1]
    below, above, tall = level - low, high - level, np.maximum(high - low, 1e-300)
    if heights.shape[1] == 2:
        part = below / tall
    else:  # a plane cuts a small triangle off at the lower or at the upper corner
        middle = h[:, 1]
        lower = below**2 / (tall * np.maximum(middle - low, 1e-300))
        upper = 1.0 - above**2 / (tall * np.maximum(high - middle, 1e-300))
        part = np.where(level <= middle, lower, upper)
    return np.asarray(np.where(below <= 0, 0.0, np.where(above <= 0, 1.0, part)))
