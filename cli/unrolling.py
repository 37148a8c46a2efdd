"""Where markers of a bent sheet are on it once it is laid flat."""

import numpy as np

from ..core.arrays import FloatArray
from ..core.subsets import outermost

#: Markers that are told a bent sheet from, at least and at most (it takes as long as the cube of their number, and the
#: others follow from these), and neighbours of each whose distances count.
_FEWEST, _MOST, _NEIGHBOURS = 9, 300, 8
#: As many markers next to a place say how the sheet goes on there.
NEAREST = 6
#: Distances between neighbours may differ by this share, root mean square, between sheet and space: folds make more.
_KEPT = 0.03
#: Steps of the majorization, and the change of a place at which it rests, as a share of the distances.
_STEPS, _RESTS = 300, 1e-6


def unrolled(points: FloatArray) -> FloatArray | None:
    """Places ``(P, 2)`` about their middle [m] of markers ``(P, 3)`` on a sheet that bends, but hardly stretches.

    They begin where distances along chains of neighbours put them (Tenenbaum, de Silva and Langford, *A global
    geometric framework for nonlinear dimensionality reduction*, 2000) and are moved until those of neighbours are what
    they are in space (de Leeuw, *Applications of convex analysis to multidimensional scaling*, 1977). None if there are
    too few markers, they fall into parts, or no flat sheet has such distances.
    """
    count = len(points)
    if count < _FEWEST:
        return None
    if count > _MOST:
        some = outermost(points, _MOST)
        known = unrolled(points[some])
        if known is None:
            return None
        every = placed(points, points[some], known, NEAREST)[0]
        return np.asarray(every - every.mean(axis=0))
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    near = np.zeros((count, count), bool)
    np.put_along_axis(near, np.argsort(apart, axis=1)[:, 1 : _NEIGHBOURS + 1], True, axis=1)
    near |= near.T
    along = np.where(near, apart, np.inf)
    np.fill_diagonal(along, 0.0)
    for k in range(count):  # Floyd and Warshall
        along = np.minimum(along, along[:, k, None] + along[None, k])
    if not np.isfinite(along).all():
        return None
    middle = np.eye(count) - 1.0 / count
    values, vectors = np.linalg.eigh(-0.5 * middle @ along**2 @ middle)
    places = vectors[:, -2:] * np.sqrt(np.maximum(values[-2:], 0.0))
    weights = near.astype(float)
    laplacian = np.linalg.pinv(np.diag(weights.sum(axis=1)) - weights)
    for _ in range(_STEPS):
        now = np.linalg.norm(places[:, None] - places[None], axis=2)
        pull = -weights * apart / np.maximum(now, 1e-12)
        np.fill_diagonal(pull, 0.0)
        np.fill_diagonal(pull, -pull.sum(axis=1))
        before, places = places, laplacian @ (pull @ places)
        if np.abs(places - before).max() < _RESTS * apart.max():
            break
    now = np.linalg.norm(places[:, None] - places[None], axis=2)
    off = np.sqrt(np.mean((now[near] / apart[near] - 1.0) ** 2))
    return places if off < _KEPT else None


def placed(where: FloatArray, points: FloatArray, places: FloatArray, near: int) -> tuple[FloatArray, FloatArray]:
    """Where ``(N, 3)`` are on a sheet that goes on as under the nearest markers ``(N, 2)``, and how far beside it [m].

    Args:
        where: to place.
        points: markers in space ``(P, 3)``.
        places: of the markers on the flat sheet ``(P, 2)``.
        near: how many of them say how the sheet goes on.
    """
    found, beside = np.zeros((len(where), 2)), np.zeros(len(where))
    for k, point in enumerate(where):
        some = np.argsort(np.linalg.norm(points - point, axis=1), kind="stable")[:near]
        at, on = points[some].mean(axis=0), places[some].mean(axis=0)
        slopes = np.linalg.lstsq(places[some] - on, points[some] - at, rcond=None)[0]
        away = np.linalg.lstsq(slopes.T, point - at, rcond=None)[0]
        found[k], beside[k] = on + away, np.linalg.norm(point - at - away @ slopes)
    return found, beside
