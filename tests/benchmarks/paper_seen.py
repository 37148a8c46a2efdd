"""What a camera sees of a trajectory: keypoints as a detector gives them."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.camera import Camera
from muslin.core.keypoints import keypoint_weights
from muslin.core.scene import Scene
from muslin.core.visibility import visible
from muslin.perception.flaws import flawed

Space = Literal["pixels", "metres"]
#: Standard deviation of the noise of a keypoint, and the chance that one in view is missed all the same.
NOISE: dict[str, float] = {"pixels": 2.0, "metres": 0.006}
MISSED = 0.05


@dataclass(frozen=True, eq=False)
class Detector:
    """Keypoints of a trajectory: projected, noisy, in no order, without those that something hides.

    Args:
        scene: in which it moves, with the mesh of the object.
        camera: that sees it.
        count: K.
        space: ``"pixels"``, or ``"metres"`` where the camera is calibrated and has depth.
    """

    scene: Scene
    camera: Camera
    count: int
    space: Space = "pixels"

    def __call__(self, vertices: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Keypoints ``(T, K, 2 or 3)`` [px or m] of the object at ``vertices (T, V, 3)`` [m]; NaN where not seen."""
        points = keypoint_weights(self.scene.body, self.count) @ vertices
        seen = visible(self.scene, self.camera, vertices, points)
        found = self.camera.project(points)[0] if self.space == "pixels" else points
        return flawed(found, seen, NOISE[self.space], MISSED, True, rng)
