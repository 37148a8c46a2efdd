"""Domain randomisation: looks and cameras at random, so that what is learned does not depend on them.

References:
    Tobin et al., *Domain randomization for transferring deep neural networks from simulation to the real world*, 2017.
"""

from dataclasses import replace

import numpy as np

from ..core.arrays import IntArray
from ..core.camera import Camera
from ..core.motion import multiply
from ..core.picture import Appearance, Image, Light, Paint

#: Pixels along each edge of a random texture.
_TEXTURE = 32


def random_appearance(rng: np.random.Generator, obstacles: int = 1) -> Appearance:
    """Colours, prints, backgrounds and a lamp at random; half of all objects and backgrounds have one colour.

    Args:
        rng: that it is drawn from.
        obstacles: how many paints they need.
    """
    direction = rng.normal(size=3) * [1.0, 1.0, 0.3] + [0.0, 0.0, 1.2]
    ambient = float(rng.uniform(0.35, 0.65))
    return Appearance(
        object=_paint(rng),
        background=_paint(rng),
        obstacles=tuple(_paint(rng) for _ in range(max(1, obstacles))),
        light=Light((float(direction[0]), float(direction[1]), float(abs(direction[2]) + 0.1)), ambient, 1.0 - ambient),
    )


def shaken(camera: Camera, rng: np.random.Generator, place: float = 0.03, turn: float = 0.03) -> Camera:
    """The camera moved a little, as where it is set up again.

    Args:
        camera: to move.
        rng: that it is drawn from.
        place: standard deviation of its position along each axis, over its distance from the world's origin [1].
        turn: standard deviation of its rotation about each of its axes [rad].
    """
    distance = max(float(np.linalg.norm(camera.pose[:3])), 0.1)
    half = 0.5 * turn * rng.normal(size=3)
    small = np.concatenate([[1.0], half]) / np.sqrt(1.0 + half @ half)
    moved = camera.pose[:3] + place * distance * rng.normal(size=3)
    pose = np.concatenate([moved, multiply(camera.pose[3:], small)])
    return replace(camera, pose=pose)


def _paint(rng: np.random.Generator) -> Paint:
    colour = rng.integers(20, 236, 3)
    if rng.random() < 0.5:
        return int(colour[0]), int(colour[1]), int(colour[2])
    return _print(rng, colour)


def _print(rng: np.random.Generator, colour: IntArray) -> Image:
    """A picture of stripes, a check, or soft spots of two colours."""
    other = rng.integers(20, 236, 3)
    v, u = np.meshgrid(*(np.linspace(0, 1, _TEXTURE),) * 2, indexing="ij")
    kind = rng.integers(3)
    if kind == 2:
        coarse = rng.random((5, 5))
        place = np.linspace(0, 4, _TEXTURE)
        rows = np.stack([np.interp(place, np.arange(5), column) for column in coarse.T], axis=1)
        share = np.stack([np.interp(place, np.arange(5), row) for row in rows])
    else:
        across = np.sin(2 * np.pi * (rng.uniform(1.5, 5) * u + rng.random()))
        down = np.sin(2 * np.pi * (rng.uniform(1.5, 5) * v + rng.random()))
        share = (across > 0).astype(float) if kind == 0 else (across * down > 0).astype(float)
    return np.asarray(colour + share[..., None] * (other - colour), np.uint8)
