"""Bidirectional Chamfer distance between what pictures show, over time: the evaluation metric of the paper.

References:
    Antonova, Yang, Sundaresan, Fox, Ramos and Bohg, *A Bayesian Treatment of Real-to-Sim for Deformable Object
    Manipulation*, 2022. Felzenszwalb and Huttenlocher, *Distance transforms of sampled functions*, 2012: exact, in
    time linear in the pixels.
"""

import cv2
import numpy as np
from scipy.spatial import cKDTree

from ..core.arrays import BoolArray, FloatArray
from ..core.camera import Camera
from ..core.errors import InputError
from ..core.picture import OBJECT
from ..core.renderer import Renderer
from ..core.scene import Scene


def masks(renderer: Renderer, scene: Scene, camera: Camera, vertices: FloatArray) -> BoolArray:
    """The object's pixels ``(T, H, W)`` in pictures of it at ``vertices (T, V, 3)`` [m]."""
    with renderer.open(scene) as view:
        return np.stack([view.render(v, camera).segmentation == OBJECT for v in vertices])


def mask_chamfer(one: BoolArray, other: BoolArray) -> FloatArray:
    """Distance [px] between the pixels of two masks ``(T, H, W)`` in every frame ``(T,)``.

    Half the sum of the mean distances from a pixel of either to the nearest of the other. A frame in which either has
    no pixel counts the picture's diagonal.
    """
    if one.shape != other.shape or one.ndim != 3:
        raise InputError(f"masks must have one shape (T, H, W), but have {one.shape} and {other.shape}")
    return np.array([_apart(a, b) for a, b in zip(one, other, strict=True)])


def point_chamfer(points: FloatArray, mask: BoolArray) -> FloatArray:
    """Distance [px] between points and the pixels of a mask in every frame ``(T,)``.

    Half the sum of the mean distance from a point to the nearest pixel, 0 on the mask, and from a pixel to the nearest
    point. A frame in which no point or no pixel is seen counts the picture's diagonal.

    Args:
        points: ``(T, K, 2)`` [px], NaN where not seen.
        mask: ``(T, H, W)``.
    """
    if points.ndim != 3 or points.shape[2] != 2 or len(points) != len(mask):
        raise InputError(f"points must have shape (T, K, 2) for {len(mask)} masks, but have {points.shape}")
    out = np.empty(len(mask))
    for t, (spots, pixels) in enumerate(zip(points, mask, strict=True)):
        spots = spots[np.isfinite(spots).all(axis=1)]
        if not (len(spots) and pixels.any()):
            out[t] = np.hypot(*pixels.shape)
            continue
        places = np.argwhere(pixels)[:, ::-1].astype(float)
        to_mask = np.where(on_mask(spots, pixels), 0.0, _to_nearest(spots, places))
        out[t] = 0.5 * (to_mask.mean() + _to_nearest(places, spots).mean())
    return out


def _to_nearest(points: FloatArray, others: FloatArray) -> FloatArray:
    """Distance ``(N,)`` from ``points (N, 2)`` to the nearest of ``others (M, 2)``."""
    return np.asarray(cKDTree(others).query(points)[0])


def on_mask(points: FloatArray, mask: BoolArray) -> BoolArray:
    """Which of ``points (K, 2)`` [px] lie in a pixel of ``mask (H, W)``; one that is NaN does not."""
    column, row = np.rint(np.where(np.isfinite(points), points, -1.0)).astype(int).T
    height, width = mask.shape
    inside: BoolArray = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    inside[inside] = mask[row[inside], column[inside]]
    return inside


def _apart(a: BoolArray, b: BoolArray) -> float:
    if not (a.any() and b.any()):
        return float(np.hypot(*a.shape))
    # what is beyond the box around both has no pixel of either
    rows, columns = np.flatnonzero((a | b).any(axis=1)), np.flatnonzero((a | b).any(axis=0))
    box = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    a, b = a[box], b[box]
    return 0.5 * (_mean_distance(a, b) + _mean_distance(b, a))


def _mean_distance(a: BoolArray, b: BoolArray) -> float:
    """Mean distance [px] from the pixels of ``a (H, W)`` to the nearest of ``b``; each has one."""
    distance = np.asarray(cv2.distanceTransform((~b).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE))[a]
    # the square of a distance between pixels is a whole number, which takes back what single precision lost
    return float(np.sqrt(np.rint(distance.astype(float) ** 2)).mean())
