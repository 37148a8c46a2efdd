"""What a camera sees of a trajectory: keypoints as a detector gives them, and the pixels of the object."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.ndimage import distance_transform_edt

from muslin.core.arrays import BoolArray, FloatArray
from muslin.core.camera import Camera
from muslin.core.keypoints import keypoint_weights
from muslin.core.picture import OBJECT
from muslin.core.renderer import Renderer
from muslin.core.scene import Scene
from muslin.core.visibility import visible

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
        seen = visible(self.scene, self.camera, vertices, points) & (rng.random(points.shape[:2]) >= MISSED)
        found = self.camera.project(points)[0] if self.space == "pixels" else points
        found = found + NOISE[self.space] * rng.normal(size=found.shape)
        found[~seen] = np.nan
        order = rng.permuted(np.tile(np.arange(self.count), (len(found), 1)), axis=1)
        return np.asarray(np.take_along_axis(found, order[..., None], axis=1))


def masks(renderer: Renderer, scene: Scene, camera: Camera, vertices: FloatArray) -> BoolArray:
    """The object's pixels ``(T, H, W)`` in pictures of it at ``vertices (T, V, 3)`` [m]."""
    with renderer.open(scene) as view:
        return np.stack([view.render(v, camera).segmentation == OBJECT for v in vertices])


def chamfer(one: BoolArray, other: BoolArray) -> float:
    """Bidirectional Chamfer distance [px] between the pixels of two masks ``(T, H, W)``, averaged over time.

    Half the sum of the mean distances from a pixel of either to the nearest of the other. Frames in which either has
    no pixel count the picture's diagonal.
    """
    return float(np.mean([_apart(a, b) for a, b in zip(one, other, strict=True)]))


def _apart(a: BoolArray, b: BoolArray) -> float:
    if not (a.any() and b.any()):
        return float(np.hypot(*a.shape))
    # what is beyond the box around both has no pixel of either
    rows, columns = np.flatnonzero((a | b).any(axis=1)), np.flatnonzero((a | b).any(axis=0))
    box = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    a, b = a[box], b[box]
    return 0.5 * float(distance_transform_edt(~b)[a].mean() + distance_transform_edt(~a)[b].mean())
