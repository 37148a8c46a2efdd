"""What a camera sees of an object's points: not those that the object itself or an obstacle hides."""

import numpy as np

from .arrays import BoolArray, FloatArray
from .camera import Camera
from .obstacles import Table
from .scene import Scene
from .surface import obstacle_surface

#: A point is hidden by what is nearer to the camera by more than this [m]: it lies in a surface itself.
BEHIND = 0.01


def visible(scene: Scene, camera: Camera, vertices: FloatArray, points: FloatArray) -> BoolArray:
    """Which points of the object the camera sees: in the picture, and with nothing between.

    Hidden by the object's own triangles or by other parts of a rope, by cylinders, meshes and tables. What hides must
    be nearer than the point by more than :data:`BEHIND`, of a rope by its radius more.

    Args:
        scene: with the mesh and what stands around it.
        camera: that looks.
        vertices: of the object ``(T, V, 3)`` [m].
        points: on the object at the same times ``(T, K, 3)`` [m].

    Returns:
        ``(T, K)``.
    """
    pixels, depth = camera.project(points)
    edge = np.array([camera.width, camera.height]) - 0.5
    with np.errstate(invalid="ignore"):  # pixels of what lies behind the camera are NaN
        seen = np.asarray((depth > 0) & ((pixels > -0.5) & (pixels < edge)).all(axis=-1))
    eye, body = camera.pose[:3], scene.body
    around = [np.zeros((0, 3, 3))]
    for obstacle in scene.obstacles:
        if isinstance(obstacle, Table):
            seen &= ~_below(obstacle.height, eye, points)
        else:
            surface = obstacle_surface(obstacle)
            around.append(surface.place(np.zeros((0, 3)))[surface.triangles])
    still = np.concatenate(around)
    for shape, spots, row in zip(vertices, points, seen, strict=True):
        corners = np.concatenate([still, shape[body.triangles]])
        if len(corners):
            row[row] = ~behind_triangles(eye, spots[row], corners)
        if body.kind == "rope":
            row[row] = ~_behind_rope(eye, spots[row], shape, scene.contact_radius)
    return seen


def behind_triangles(eye: FloatArray, points: FloatArray, corners: FloatArray) -> BoolArray:
    """Which of ``points (N, 3)`` have a triangle of ``corners (F, 3, 3)`` between them and ``eye (3,)`` ``(N,)``.

    References:
        Moeller and Trumbore, *Fast, minimum storage ray/triangle intersection*, 1997.
    """
    away = points - eye
    distance = np.linalg.norm(away, axis=1, keepdims=True)
    ray = away / distance
    one, two, apart = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], eye - corners[:, 0]
    # (ray x two) . one and (ray x two) . apart as triple products, so that no array has points, triangles and axes
    determinant = ray @ np.cross(two, one).T
    inverse = 1.0 / np.where(np.abs(determinant) > 1e-14, determinant, np.inf)
    u = ray @ np.cross(two, apart).T * inverse
    q = np.cross(apart, one)
    v = ray @ q.T * inverse
    along = np.einsum("fx,fx->f", two, q) * inverse
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (along > 0) & (along < distance - BEHIND)
    return np.asarray(hit.any(axis=1))


def _behind_rope(eye: FloatArray, points: FloatArray, chain: FloatArray, radius: float) -> BoolArray:
    """Which of ``points (N, 3)`` have a part of the rope ``chain (V, 3)`` between them and ``eye (3,)`` ``(N,)``.

    A part is between if the line of sight passes it at less than its radius.

    References:
        Ericson, *Real-Time Collision Detection*, 2005, section 5.1.9: closest points of two segments.
    """
    away = points - eye
    distance = np.linalg.norm(away, axis=1, keepdims=True)
    ray = away / distance
    segment, apart = np.diff(chain, axis=0), eye - chain[:-1]
    length = np.maximum(np.einsum("sx,sx->s", segment, segment), 1e-18)
    f, b, c = np.einsum("sx,sx->s", segment, apart), ray @ segment.T, ray @ apart.T
    share = (f - b * c) / np.maximum(length - b**2, 1e-18)
    share = np.clip(share, 0.0, 1.0)
    along = b * share - c  # of the line of sight, nearest to that place of the segment
    off = apart + along[..., None] * ray[:, None] - share[..., None] * segment
    near = (np.einsum("nsx,nsx->ns", off, off) < radius**2) & (along > 0)
    return np.asarray((near & (along < distance - BEHIND - radius)).any(axis=1))


def _below(height: float, eye: FloatArray, points: FloatArray) -> BoolArray:
    """Which of ``points (..., 3)`` the plane of a table hides; from below a table hides nothing, as when drawn."""
    fall = eye[2] - points[..., 2]
    share = (eye[2] - height) / np.where(fall > 0, fall, np.inf)
    distance = np.linalg.norm(points - eye, axis=-1)
    return np.asarray((eye[2] > height) & (points[..., 2] < height) & (share * distance < distance - BEHIND))
