"""Where the markers of a flat sheet sit, told by how far apart they are seen."""

from collections.abc import Sequence

import numpy as np

from ..arrays import FloatArray, IntArray
from ..body import Body
from ..errors import InputError
from ..measurement import Recording, check_spatial
from ..scenario import Scenario
from .places import flattened, weights_at

#: Markers are neighbours up to so many times the usual distance of the nearest one: on a grid, two lines away.
_NEIGHBOURS = 2.2
#: A distance is known to this share of that usual distance, a place that was given beforehand to that one.
_DISTANCE_SD, _PLACE_SD = 0.07, 0.5
#: Fewer frames of a pair of markers tell nothing of their distance.
_FEWEST = 10
_ROUNDS = 20
#: Markers that sit further than this from where they are said to are worth a word, root mean square [m].
MATTERS = 0.005


def off_places(scenario: Scenario, recordings: Sequence[Recording]) -> FloatArray:
    """How far the markers of a flat sheet sit from where ``scenario`` says, by :func:`told_places` ``(M, 3)`` [m]."""
    told = told_places(scenario.body, scenario.markers, recordings)
    return np.asarray((told - scenario.markers) @ scenario.body.vertices)


def told_places(body: Body, markers: FloatArray, recordings: Sequence[Recording]) -> FloatArray:
    """Marker weights ``(M, V)`` as ``markers``, of places on the sheet that go with the distances that are seen.

    A sheet hardly stretches, so that neighbouring markers stay as far apart as they are on it, whatever it does; where
    it is bent they come a little nearer, in each way for some of the time. So those places on the flat sheet are taken
    whose distances fit the medians over all frames best, near those that ``markers`` gives (which alone say how the
    whole lies on the sheet): least squares by Gauss-Newton steps, as in metric multidimensional scaling (Borg and
    Groenen, *Modern Multidimensional Scaling*, 2005). A marker that would come to sit beside the sheet sits at its
    edge. Nothing is simulated.

    Args:
        body: a flat sheet.
        markers: weights ``(M, V)`` of where they are said to be.
        recordings: of these markers.

    Raises:
        InputError: not a flat sheet, points in pixels or without correspondence, or too few frames.
    """
    flat = flattened(body, "spacing = 'measured'")
    given = markers @ flat
    for recording in recordings:
        check_spatial(recording)
        if not recording.series.correspondence or recording.series.points.shape[1] != len(given):
            raise InputError(
                f"[scenario] spacing = 'measured' is for points that are followed, {len(given)} of them here, but "
                f"recording {recording.name!r} has {recording.series.points.shape[1]}"
                f"{'' if recording.series.correspondence else ' without correspondence'}; leave spacing out"
            )
    away = np.linalg.norm(given[:, None] - given[None], axis=2)
    usual = float(np.median(np.min(np.where(away > 0, away, np.inf), axis=1)))
    pairs = np.argwhere(np.triu((away > 0) & (away < _NEIGHBOURS * usual)))
    apart, seen = _distances(recordings, pairs)
    told = seen >= _FEWEST
    if not told.any():
        raise InputError(
            f"[scenario] spacing = 'measured' tells from frames that show neighbouring markers, but no pair of them is "
            f"seen in {_FEWEST} frames of {', '.join(r.name for r in recordings)}; leave spacing out"
        )
    places = _nearest_layout(given, pairs[told], apart[told], usual)
    return weights_at(flat, body.triangles, places)


def _distances(recordings: Sequence[Recording], pairs: IntArray) -> tuple[FloatArray, IntArray]:
    """Medians of how far the markers of each pair are apart [m], NaN where never, and in how many frames."""
    series = [r.series.points for r in recordings]
    both = [np.linalg.norm(p[:, pairs[:, 0]] - p[:, pairs[:, 1]], axis=2) for p in series]
    whole = np.concatenate(both)
    seen = np.isfinite(whole).sum(axis=0)
    apart = np.full(len(pairs), np.nan)
    apart[seen > 0] = np.nanmedian(whole[:, seen > 0], axis=0)
    return apart, seen


def _nearest_layout(given: FloatArray, pairs: IntArray, apart: FloatArray, usual: float) -> FloatArray:
    """Places ``(M, 2)`` near ``given (M, 2)`` whose distances are nearest to ``apart``."""
    places, known, (one, other) = given.copy(), (_DISTANCE_SD * usual) ** -2, pairs.T
    own = np.eye(2) * (_PLACE_SD * usual) ** -2
    for _ in range(_ROUNDS):
        between = places[one] - places[other]
        now = np.maximum(np.linalg.norm(between, axis=1, keepdims=True), 1e-12)
        along = between / now
        blocks = known * along[:, :, None] * along[:, None, :]
        normal = np.zeros((len(given), len(given), 2, 2))
        pull = (given - places) @ own
        normal[np.arange(len(given)), np.arange(len(given))] = own
        for k, at, sign in ((one, other, 1.0), (other, one, -1.0)):
            np.add.at(normal, (k, k), blocks)
            np.add.at(normal, (k, at), -blocks)
            np.add.at(pull, k, sign * known * (apart[:, None] - now) * along)
        matrix = normal.transpose(0, 2, 1, 3).reshape(given.size, given.size)
        step = np.linalg.solve(matrix, pull.ravel()).reshape(given.shape)
        places = places + step
        if np.abs(step).max() < 1e-6 * usual:
            break
    return places
