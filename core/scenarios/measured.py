"""A rope that starts as it was measured: through the markers of the first frame, as fast as they were."""

from dataclasses import replace

import numpy as np

from ..arrays import FloatArray
from ..beside import Beside, curves
from ..body import rope_line
from ..differences import rough_sd
from ..errors import InputError
from ..interpolation import interpolate
from ..measurement import Recording, check_spatial
from ..motion import inverse, rotate
from ..parameters import Parameter
from ..scenario import Scenario, StartMotion
from ..series import PointSeries
from .starts import GivenShape

#: What a new study infers of a rope that starts as it was measured: its length is known, and it does not stretch
#: visibly. Only stiffness over mass shows in free air; the ranges suit 0.05 kg/m.
MEASURED_PRIORS = (
    Parameter("bending_rigidity", "N m2", 1e-5, 0.1, "log", "moment per curvature"),
    Parameter("twist_rigidity", "N m2", 1e-5, 0.1, "log", "torque per twist rate"),
    Parameter("damping_time", "s", 1e-4, 1.0, "log", "of internal damping, C = beta K"),
)
#: How near the model of a rope in motion is meant to come [m], where it is seen far better. Held against the noise of
#: motion capture alone, every draw is as wrong as every other, and frames count as left to chance.
MEASURED_NEAR = 0.005
#: Frames that are further off than so many times that count by a logarithm only: what whips is left to chance.
MEASURED_TAILS = 3.0
#: Pieces in which takes of a rope in motion are fitted [s]; after more, one that whips is left to chance.
MEASURED_PIECE = 1.0

#: Points between two markers at which the curve through them is measured.
_FINE = 200
#: Parabolas through the first frames go through so many at least, and through none later than this [s].
_FEWEST, LONGEST = 5, 0.3
#: They fit where they leave no more than this times the noise.
_WITHIN = 1.5
#: Shapes before the start are so far apart [s].
_EARLIER = 0.03


def measured_start(scenario: Scenario, recording: Recording, beside: Beside | None = None) -> Scenario:
    """The scenario of a rope whose markers, in their order along it, reach from its first vertex to its last.

    In its rest shape it is straight and as long as the curve through the markers of the first frame (a natural cubic
    spline over the chords), along which every marker keeps its place. Length and so mass (at one linear density) are
    therefore those of this take: takes of one cable differ by as much as their markers are off. It is not given time to
    settle, which would take it away from where it was seen, and starts with the velocity of its markers, told by
    parabolas through their first frames: see :func:`first_motion`. Of markers that stand ``beside`` the axis all this
    is told of the places on the axis.

    Raises:
        InputError: not a rope, not x, y and z in metres, or a marker is not seen in the first frame.
    """
    check_spatial(recording)
    if scenario.body.kind != "rope" or not recording.series.correspondence:
        raise InputError(f"recording {recording.name!r}: only a rope with markers in order starts as measured")
    series = recording.series
    points = series.points[0]
    if len(points) < 3 or not np.isfinite(points).all():
        raise InputError(
            f"recording {recording.name!r}: every marker must be seen in the first frame, at least 3; start it later"
        )
    if beside is not None:
        early = series.time - series.time[0] <= LONGEST
        early[:_FEWEST] = True
        time = series.time[early]
        series = PointSeries(time, beside.axis(series.points[early], scenario.motion.at(time)))
        points = series.points[0]
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
    local = interpolate(evenly, along, local)
    start = GivenShape(local, along[-1], np.zeros(3))
    motion = first_motion(series, places)
    return replace(scenario, body=body, start=start, markers=markers, settle=0.0, start_motion=motion, beside=beside)


def with_earlier(scenario: Scenario, recording: Recording) -> Scenario:
    """The scenario of a piece of a ``recording`` that starts as measured, with the shapes that the rope was in before.

    Of the frames that show every marker, so many a second that it bends little from one to the next.
    """
    series = recording.series
    step = float(np.median(np.diff(series.time)))
    seen = np.isfinite(series.points).all(axis=(1, 2)) & (series.time < scenario.times[0])
    frames = np.flatnonzero(seen)[:: max(1, round(_EARLIER / step))]
    if not len(frames):
        return scenario
    points, count = series.points[frames], len(scenario.body.vertices)
    if scenario.beside is not None:
        points = scenario.beside.axis(points, scenario.motion.at(series.time[frames]))
    out = np.empty((len(points), count, 3))
    for k, curve in enumerate(curves(points)[0]):
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
        out[k] = interpolate(np.linspace(0.0, along[-1], count), along, curve)
    return replace(scenario, earlier=out)


def first_motion(series: PointSeries, places: FloatArray) -> StartMotion | None:
    """Velocities and accelerations in the first frame, at places evenly along the rope.

    A parabola is fitted to the first frames of every marker, as many as one fits within the noise, by which it is told
    in turn how far the first frames are from smooth; longer stretches are surer where noise is large. None where the
    frames are too few to tell.

    Args:
        series: markers ``(T, P, 3)`` [m].
        places: of the markers along the rope ``(P,)`` [m].
    """
    time = series.time - series.time[0]
    most = int(np.searchsorted(time, LONGEST, side="right"))
    points = series.points[: max(most, _FEWEST)]
    noise = rough_sd([points])
    best: FloatArray | None = None
    for count in range(_FEWEST, len(points) + 1):
        found, left = _parabolas(time[:count], points[:count])
        if best is not None and left > _WITHIN * noise:
            break
        best = found
    if best is None:
        return None
    known = np.isfinite(best).all(axis=(0, 2))
    if not known.any():
        return None
    evenly = np.linspace(0.0, places[-1], _FINE)
    speed, change = (interpolate(evenly, places[known], v[known]) for v in best)
    return StartMotion(speed, change)


def _parabolas(time: FloatArray, points: FloatArray) -> tuple[FloatArray, float]:
    """First and second derivatives ``(2, P, 3)`` at time zero, and the root mean square of what is left [m].

    NaN for markers that are seen in too few frames.
    """
    out, left = np.full((2, points.shape[1], 3), np.nan), []
    for p in range(points.shape[1]):
        seen = np.isfinite(points[:, p]).all(axis=1)
        if seen.sum() < _FEWEST:
            continue
        rows = np.stack([np.ones(seen.sum()), time[seen], 0.5 * time[seen] ** 2], axis=1)
        solved = np.linalg.lstsq(rows, points[seen, p], rcond=None)[0]
        out[:, p] = solved[1:]
        left.append(np.sum((points[seen, p] - rows @ solved) ** 2) / (3 * (seen.sum() - 3)))
    return out, float(np.sqrt(np.mean(left))) if left else 0.0


def _curve(points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The natural cubic spline through ``points (M, 3)``: finely sampled, its length so far, that at the points."""
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if not (chords > 0).all():
        raise InputError(f"markers {int(np.argmin(chords))} and the next are at one place in the first frame")
    (curve,), places = curves(points[None], _FINE)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    return curve, along, along[places]
