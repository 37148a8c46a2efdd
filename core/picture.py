"""What a picture is made of, and what things look like in it."""

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from .arrays import FloatArray
from .errors import InputError

Image: TypeAlias = npt.NDArray[np.uint8]
DepthImage: TypeAlias = npt.NDArray[np.float32]
#: A colour, red green blue 0 to 255, or a picture ``(h, w, 3)``.
Paint: TypeAlias = tuple[int, int, int] | Image

#: Values of a segmentation; obstacle number k has OBSTACLE + k.
BACKGROUND, OBJECT, OBSTACLE = 0, 1, 2


@dataclass(frozen=True)
class Light:
    """A distant lamp without shadows: a surface shows colour * (ambient + diffuse * max(0, n . towards)).

    Args:
        towards: the lamp, a direction of any length in the world.
        ambient, diffuse: shares of the colour [1].
    """

    towards: tuple[float, float, float] = (0.3, -0.6, 0.74)
    ambient: float = 0.45
    diffuse: float = 0.55

    def __post_init__(self) -> None:
        if not (np.isfinite(self.towards).all() and np.linalg.norm(self.towards) > 0):
            raise InputError(f"a light needs a direction that is not zero, got {self.towards}")
        if not (0 <= self.ambient <= 1 and 0 <= self.diffuse <= 1):
            raise InputError(f"light must be 0 to 1, got ambient {self.ambient:g} and diffuse {self.diffuse:g}")

    @property
    def direction(self) -> FloatArray:
        """The unit vector towards the lamp ``(3,)``."""
        return np.asarray(np.array(self.towards) / np.linalg.norm(self.towards))


@dataclass(frozen=True, eq=False)
class Appearance:
    """What things look like.

    Args:
        object: colour or texture of the object.
        background: colour, or a picture that is stretched over the whole frame.
        obstacles: colours or textures, in the order of the scene's obstacles, starting again at the end; a table
            shows the mean colour of a texture.
        light: the one lamp.
    """

    object: Paint = (196, 72, 50)
    background: Paint = (236, 236, 232)
    obstacles: tuple[Paint, ...] = ((150, 156, 168), (120, 140, 120))
    light: Light = field(default_factory=Light)

    def __post_init__(self) -> None:
        if not self.obstacles:
            raise InputError("an appearance needs at least one colour for obstacles")
        for what, paint in (("object", self.object), ("background", self.background), *_named(self.obstacles)):
            _check_paint(what, paint)


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture.

    Args:
        rgb: ``(H, W, 3)``, 0 to 255.
        depth: along the optical axis ``(H, W)`` [m]; NaN where there is only background.
        segmentation: ``(H, W)``: 0 background, 1 the object, 2 + k obstacle k.
    """

    rgb: Image
    depth: DepthImage
    segmentation: Image


def _named(paints: tuple[Paint, ...]) -> list[tuple[str, Paint]]:
    return [(f"obstacle {k}", paint) for k, paint in enumerate(paints)]


def _check_paint(what: str, paint: Paint) -> None:
    if isinstance(paint, np.ndarray):
        right = paint.ndim == 3 and paint.shape[2] == 3 and paint.dtype == np.uint8 and paint.size
    else:
        right = len(paint) == 3 and all(isinstance(c, int) and 0 <= c <= 255 for c in paint)
    if not right:
        raise InputError(f"the {what} needs a colour of three whole numbers 0 to 255, or a uint8 picture (h, w, 3)")


def texture_of(paint: Paint) -> Image:
    """The picture ``(h, w, 3)`` of a paint; a colour is a picture of four pixels."""
    return np.ascontiguousarray(paint if isinstance(paint, np.ndarray) else np.full((2, 2, 3), paint, np.uint8))


def texel_centres(uv: FloatArray, texture: Image) -> FloatArray:
    """``uv (N, 2)`` from 0 to 1 laid from the first to the last pixel centre, so that no edge shows its opposite."""
    size = np.array([texture.shape[1], texture.shape[0]], float)
    return np.asarray((uv * (size - 1.0) + 0.5) / size)


def stretched(paint: Paint, shape: tuple[int, int]) -> Image:
    """A paint over a whole frame, by nearest pixel."""
    picture = texture_of(paint)
    rows = (np.arange(shape[0]) + 0.5) * picture.shape[0] / shape[0]
    columns = (np.arange(shape[1]) + 0.5) * picture.shape[1] / shape[1]
    return picture[np.ix_(rows.astype(int), columns.astype(int))]
