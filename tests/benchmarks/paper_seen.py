"""What a camera sees of a trajectory: keypoints as a detector gives them, and the pixels of the object."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.ndimage import distance_transform_edt

from muslin.core.arrays import BoolArray, FloatArray
from muslin.core.body import Body
from muslin.core.camera import Camera
from muslin.core.obstacles import Cylinder
from muslin.core.picture import OBJECT
from muslin.core.renderer import Renderer
from muslin.core.scene import Scene
from muslin.core.surface import obstacle_surface

Space = Literal["pixels", "metres"]
#: Standard deviation of the noise of a keypoint, and the chance that one in view is missed all the same.
NOISE: dict[str, float] = {"pixels": 2.0, "metres": 0.006}
MISSED = 0.05
#: A keypoint is hidden by what is nearer to the camera by more than this [m]: it lies in the surface itself.
BEHIND = 0.01


def keypoint_weights(body: Body, count: int) -> FloatArray:
    """Weights ``(K, V)`` of the keypoints: corners of a cloth, then middles of its edges; even along a rope."""
    if body.kind == "rope":
        place = np.linspace(0.0, len(body.vertices) - 1.0, count)
        left = np.minimum(place.astype(int), len(body.vertices) - 2)
        weights = np.zeros((count, len(body.vertices)))
        weights[np.arange(count), left] = 1.0 - (place - left)
        weights[np.arange(count), left + 1] += place - left
        return weights
    assert body.grid is not None
    rows, columns = body.grid
    r, c = rows - 1, columns - 1
    spots = [(0, 0), (0, c), (r, 0), (r, c), (0, c // 2), (r, c // 2), (r // 2, 0), (r // 2, c)]
    if count > len(spots):
        raise SystemExit(f"a cloth has {len(spots)} keypoints at most, not {count}")
    return np.eye(rows * columns)[[a * columns + b for a, b in spots[:count]]]


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

    def visible(self, vertices: FloatArray, points: FloatArray) -> BoolArray:
        """Which of ``points (T, K, 3)`` on the object at ``vertices (T, V, 3)`` the camera sees ``(T, K)``.

        Hidden by the object's own triangles or by a cylinder, or out of the picture. A rope does not hide itself.
        """
        pixels, depth = self.camera.project(points)
        edge = np.array([self.camera.width, self.camera.height]) - 0.5
        seen = np.asarray((depth > 0) & ((pixels > -0.5) & (pixels < edge)).all(axis=-1))
        eye = self.camera.pose[:3]
        if self.scene.body.kind == "cloth":
            for t, corners in enumerate(vertices[:, self.scene.body.triangles]):
                seen[t] &= ~_hidden(eye, points[t], corners)
        for obstacle in self.scene.obstacles:
            if isinstance(obstacle, Cylinder):
                surface = obstacle_surface(obstacle)
                corners = surface.place(np.zeros((0, 3)))[surface.triangles]
                seen &= ~_hidden(eye, points.reshape(-1, 3), corners).reshape(seen.shape)
        return seen

    def __call__(self, vertices: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Keypoints ``(T, K, 2 or 3)`` [px or m] of the object at ``vertices (T, V, 3)`` [m]; NaN where not seen."""
        points = keypoint_weights(self.scene.body, self.count) @ vertices
        seen = self.visible(vertices, points) & (rng.random(points.shape[:2]) >= MISSED)
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


def _hidden(eye: FloatArray, points: FloatArray, corners: FloatArray) -> BoolArray:
    """Which of ``points (N, 3)`` have a triangle of ``corners (F, 3, 3)`` between them and ``eye (3,)`` ``(N,)``.

    References:
        Moeller and Trumbore, *Fast, minimum storage ray/triangle intersection*, 1997.
    """
    away = points - eye
    distance = np.linalg.norm(away, axis=1, keepdims=True)
    ray = away / distance
    one, two, apart = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], eye - corners[:, 0]
    p = np.cross(ray[:, None], two[None])
    determinant = np.einsum("nfx,fx->nf", p, one)
    inverse = 1.0 / np.where(np.abs(determinant) > 1e-14, determinant, np.inf)
    u = np.einsum("nfx,fx->nf", p, apart) * inverse
    q = np.cross(apart, one)
    v = ray @ q.T * inverse
    along = np.einsum("fx,fx->f", two, q) * inverse
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (along > 0) & (along < distance - BEHIND)
    return np.asarray(hit.any(axis=1))
