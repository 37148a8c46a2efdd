"""Level views of moving points: the planes in which they are seen to spread most."""

import numpy as np

from ....core.arrays import FloatArray
from ....core.series import PointUnit

_UP = np.array([0.0, 0.0, 1.0])


def two_views(points: FloatArray, unit: PointUnit = "m") -> FloatArray:
    """Right and up ``(W, 2, A)`` of the views of ``points (T, Q, A)``: one of points in a plane, else two.

    Of the three views along the level main directions and from above, the two in which the points cover most. Of
    pixels the picture: their second axis points down.
    """
    axes = points.shape[2]
    if axes == 2:
        return np.diag([1.0, -1.0 if unit == "px" else 1.0])[None]
    flat = points.reshape(-1, axes)
    flat = flat[np.isfinite(flat).all(axis=1)]
    level = flat[:, :2] - flat[:, :2].mean(axis=0)
    main = np.linalg.svd(level.T @ level)[0][:, 0]
    main = main * np.sign(main[np.abs(main).argmax()])
    right, depth = np.array([*main, 0.0]), np.array([-main[1], main[0], 0.0])
    depth = depth * np.sign(depth[np.abs(depth).argmax()])
    views = np.stack([np.stack([right, _UP]), np.stack([depth, _UP]), np.stack([right, depth])])
    spread = [np.prod(np.ptp(flat @ v.T, axis=0) + 1e-12) for v in views]
    kept = np.sort(np.argsort(spread)[1:])
    return np.asarray(views[kept])
