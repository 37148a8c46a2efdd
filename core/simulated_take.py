"""A simulated take as a camera would have seen it."""

from dataclasses import dataclass

import numpy as np

from .arrays import BoolArray, FloatArray
from .camera import Camera
from .errors import InputError
from .frames import Frames
from .picture import OBJECT, Appearance
from .renderer import find_renderer
from .scene import Scene
from .series import PointSeries, PointUnit


@dataclass(frozen=True, eq=False)
class SimulatedTake:
    """What one rollout gave, and who looks at it.

    Args:
        series: the markers ``(T, P, 3)`` [m].
        vertices: ``(T, V, 3)`` [m] at the same times.
        scene: in which the object moved.
        camera: that took the recording that is compared with, or None where it is not known.
        unit: of that recording; what a depth camera measured is in metres.
    """

    series: PointSeries
    vertices: FloatArray
    scene: Scene
    camera: Camera | None = None
    unit: PointUnit = "px"

    def projected(self) -> PointSeries:
        """The markers in pixels ``(T, P, 2)``; NaN where they are behind the camera.

        What lies beyond the picture's edge keeps its place there: how far off a model is should not end at the edge.
        """
        pixels = self._camera("projected").project(self.series.points)[0]
        return PointSeries(self.series.time, pixels, "px", self.series.correspondence)

    def frames(self, renderer: str = "auto", appearance: Appearance | None = None) -> Frames:
        """Pictures with depth of every frame, by the renderer of that name."""
        camera = self._camera("rendered")
        with find_renderer(renderer).open(self.scene, appearance) as view:
            made = [view.render(v, camera) for v in self.vertices]
        return Frames(np.stack([f.rgb for f in made]), np.stack([f.depth for f in made]), camera=camera)

    def masks(self, renderer: str = "auto") -> BoolArray:
        """The pixels of the object ``(T, H, W)`` in every frame, whatever it looks like."""
        camera = self._camera("rendered")
        with find_renderer(renderer).open(self.scene) as view:
            return np.stack([view.render(v, camera).segmentation == OBJECT for v in self.vertices])

    def _camera(self, what: str) -> Camera:
        if self.camera is None:
            raise InputError(
                f"a simulated take cannot be {what} without a camera; import the recording with --camera FILE"
            )
        return self.camera
