"""A rope that starts as it was measured: through the markers of the first frame, at rest."""

from dataclasses import replace

import numpy as np

from ..arrays import FloatArray
from ..body import rope_line
from ..errors import InputError
from ..measurement import Recording, check_spatial
from ..motion import inverse, rotate
from ..scenario import Scenario
from .starts import GivenShape

#: Points between two markers at which the curve through them is measured.
_FINE = 200


def measured_start(scenario: Scenario, recording: Recording) -> Scenario:
    """The scenario of a rope whose markers, in their order along it, reach from its first vertex to its last.

    At rest it is straight and as long as the curve through the markers of the first frame (a natural cubic spline over
    the chords), along which every marker keeps its place. Length and so mass (at one linear density) are therefore
    those of this take: takes of one cable differ by as much as their markers are off. It is not given time to settle,
    which would take it away from where it was seen.

    Raises:
        InputError: not a rope, not x, y and z in metres, or a marker is not seen in the first frame.
    """
    check_spatial(recording)
    if scenario.body.kind != "rope" or not recording.series.correspondence:
        raise InputError(f"recording {recording.name!r}: only a rope with markers in order starts as measured")
    points = recording.series.points[0]
    if len(points) < 3 or not np.isfinite(points).all():
        raise InputError(
            f"recording {recording.name!r}: every marker must be seen in the first frame, at least 3; start it later"
        )
    curve, along, places = _curve(points)
    count = len(scenario.body.vertices)
    body = rope_line(np.array([[0.0, 0.0, 0.0], [along[-1], 0.0, 0.0]]), count)
    pose = scenario.motion.at(scenario.times[:1])[0, 0]
    local = rotate(inverse(pose[3:]), curve - pose[:3])
    share = places / along[-1] * (count - 1)
    left = np.minimum(share.astype(np.int64), count - 2)
    markers = np.zeros((len(points), count))
    markers[np.arange(len(points)), left] = 1.0 - (share - left)
    markers[np.arange(len(points)), left + 1] = share - left
    evenly = np.linspace(0.0, along[-1], len(along))
    local = np.stack([np.interp(evenly, along, local[:, k]) for k in range(3)], axis=1)
    start = GivenShape(local, along[-1], np.zeros(3))
    return replace(scenario, body=body, start=start, markers=markers, settle=0.0)


def _curve(points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The natural cubic spline through ``points (M, 3)``: finely sampled, its length so far, that at the points."""
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if not (chords > 0).all():
        raise InputError(f"markers {int(np.argmin(chords))} and the next are at one place in the first frame")
    count = len(points)
    matrix, right = np.eye(count), np.zeros((count, 3))
    for k in range(1, count - 1):  # second derivatives: the slopes on both sides of every inner point agree
        a, b = chords[k - 1], chords[k]
        matrix[k, k - 1 : k + 2] = a, 2 * (a + b), b
        right[k] = 6 * ((points[k + 1] - points[k]) / b - (points[k] - points[k - 1]) / a)
    bends = np.linalg.solve(matrix, right)
    u = np.linspace(0.0, 1.0, _FINE, endpoint=False)[:, None]
    parts = []
    for k, h in enumerate(chords):
        straight = (1 - u) * points[k] + u * points[k + 1]
        parts.append(straight + h**2 / 6 * (((1 - u) ** 3 - (1 - u)) * bends[k] + (u**3 - u) * bends[k + 1]))
    curve = np.concatenate([*parts, points[-1:]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    return curve, along, along[::_FINE]
