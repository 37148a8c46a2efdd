"""Rest shapes of the built-in scenarios, in the frame of the first gripper at its first pose."""

from dataclasses import replace

import numpy as np

from ..body import Body, cloth_grid, rope_line, solid_box

Size = tuple[float, ...]
Counts = tuple[int, ...]


def hanging(size: Size, counts: Counts) -> Body:
    """Cloth in the x-z plane below the middle of its top edge, or a rope straight down from its first vertex."""
    if len(size) == 1:
        return rope_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -size[0]]]), counts[0])
    return cloth_grid(size[0], size[1], counts[0], counts[1])


def level(size: Size, counts: Counts) -> Body:
    """Cloth in the x-y plane: vertices and warp as of :func:`~muslin.core.body.cloth_grid`, row 0 along y = 0."""
    upright = cloth_grid(size[0], size[1], counts[0], counts[1])
    return replace(upright, vertices=upright.vertices[:, [0, 2, 1]])


def ahead(size: Size, counts: Counts) -> Body:
    """A straight rope from its first vertex along x."""
    return rope_line(np.array([[0.0, 0.0, 0.0], [size[0], 0.0, 0.0]]), counts[0])


def behind(size: Size, counts: Counts) -> Body:
    """A straight rope from its first vertex against x."""
    return rope_line(np.array([[0.0, 0.0, 0.0], [-size[0], 0.0, 0.0]]), counts[0])


def silicone_beam(size: Size, counts: Counts) -> Body:
    """The beam of Dubied et al. (2022) in the frame of its motion capture turned z up.

    Cross-section and tip face are placed from the marker coordinates that its authors publish.
    """
    low = np.array([0.0153, -0.0264, 0.0386])
    return solid_box(low, low + np.array(size), (counts[0], counts[1], counts[2]))
