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
#: Polynomials through the nearest frames, of this degree, go through so many at least: those of one side, of both.
_ONE_SIDED, _TWO_SIDED = (2, 5), (3, 7)
#: They go through none farther off than this [s].
LONGEST = 0.3
#: They fit where they leave no more than this times the noise.
_WITHIN = 1.5
#: Shapes before the start are so far apart [s].
_EARLIER = 0.03


def measured_start(scenario: Scenario, recording: Recording, beside: Beside | None = None) -> Scenario:
    """The scenario of a rope whose markers, in their order along it, reach from its first vertex to its last.

    In its rest shape it is straight and as long as the curve through the markers of the first frame (a natural cubic
    spline over the chords), along which every marker keeps its place. Length and so mass (at one linear density) are
    therefore those of this take: takes of one cable differ by as much as their markers are off. It is not given time to
    settle, which would take it away from where it was seen, and starts with the velocity of its markers in the first
    frame: see :func:`motion_at`. Of markers that stand ``beside`` the axis all this is told of the places on the axis.

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
        series = _on_axis(series, float(series.time[0]), scenario, beside)
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
    motion = motion_at(series, float(series.time[0]), places)
    return replace(scenario, body=body, start=start, markers=markers, settle=0.0, start_motion=motion, beside=beside)


def with_earlier(scenario: Scenario, recording: Recording) -> Scenario:
    """The scenario of a piece of a ``recording`` that starts as measured, with what was seen of the rope before.

    The shapes that it was in, of the frames that show every marker, so many a second that it bends little from one to
    the next; and how it moves at the start, which frames before and after tell better than those after it alone.
    """
    series, start = recording.series, float(scenario.times[0])
    step = float(np.median(np.diff(series.time)))
    seen = np.isfinite(series.points).all(axis=(1, 2)) & (series.time < start)
    frames = np.flatnonzero(seen)[:: max(1, round(_EARLIER / step))]
    if not len(frames):
        return scenario
    points, count = series.points[frames], len(scenario.body.vertices)
    near = series
    if scenario.beside is not None:
        points = scenario.beside.axis(points, scenario.motion.at(series.time[frames]))
        near = _on_axis(series, start, scenario, scenario.beside)
    out = np.empty((len(points), count, 3))
    for k, curve in enumerate(curves(points)[0]):
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
        out[k] = interpolate(np.linspace(0.0, along[-1], count), along, curve)
    return in_motion(replace(scenario, earlier=out), near)


def in_motion(scenario: Scenario, series: PointSeries) -> Scenario:
    """The scenario of a rope that moves at the start as places on its axis ``(T, P, 3)`` do before it and after it."""
    start = float(scenario.times[0])
    places = _curve(series.points[int(np.argmin(np.abs(series.time - start)))])[2]
    return replace(scenario, start_motion=motion_at(series, start, places))


def motion_at(series: PointSeries, time: float, places: FloatArray) -> StartMotion | None:
    """Velocities and accelerations in the frame at ``time`` [s], at places evenly along the rope.

    A polynomial is fitted to the nearest frames of every marker, as many as one fits within the noise, by which it is
    told in turn how far they are from smooth; longer stretches are surer where noise is large. It is a cubic between
    frames before and after, and a parabola at the ends of a recording and of a gap. None where frames are too few.

    Args:
        series: markers ``(T, P, 3)`` [m].
        time: of one of its frames.
        places: of the markers along the rope ``(P,)`` [m].
    """
    off = series.time - time
    shown = np.flatnonzero(np.any(np.isfinite(series.points).all(axis=2), axis=1))
    nearest = shown[np.argsort(np.abs(off[shown]), kind="stable")]
    around = off[nearest[: _TWO_SIDED[1]]]
    degree, fewest = _TWO_SIDED if (around < 0.0).any() and (around > 0.0).any() else _ONE_SIDED
    nearest = nearest[: max(int(np.sum(np.abs(off[shown]) <= LONGEST)), fewest)]
    off, points = off[nearest], series.points[nearest]
    noise = rough_sd([series.points[np.sort(nearest)]])
    best: FloatArray | None = None
    for count in range(fewest, len(points) + 1):
        found, left = _polynomials(off[:count], points[:count], degree)
        if best is not None and np.isfinite(best).any() and left > _WITHIN * noise:
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


def _on_axis(series: PointSeries, time: float, scenario: Scenario, beside: Beside) -> PointSeries:
    """Places on the axis of markers that stand beside it, in all frames that tell the motion at ``time`` [s]."""
    off = np.abs(series.time - time)
    near = off <= max(LONGEST, float(np.sort(off)[: _TWO_SIDED[1]][-1]))
    times = series.time[near]
    return PointSeries(times, beside.axis(series.points[near], scenario.motion.at(times)))


def _polynomials(time: FloatArray, points: FloatArray, degree: int) -> tuple[FloatArray, float]:
    """First and second derivatives ``(2, P, 3)`` at time zero, and the root mean square of what is left [m].

    NaN for markers that are seen in too few frames.
    """
    out, left = np.full((2, points.shape[1], 3), np.nan), []
    scale = np.array([1.0, 1.0, 0.5, 1.0 / 6.0])[: degree + 1]
    all_rows = scale * np.vander(time, degree + 1, increasing=True)
    patterns, which = np.unique(np.isfinite(points).all(axis=2), axis=1, return_inverse=True)
    for p, seen in enumerate(patterns.T):  # markers that are seen in the same frames
        if seen.sum() < degree + 3:
            continue
        own = np.flatnonzero(which.ravel() == p)
        rows, right = all_rows[seen], points[seen][:, own].reshape(seen.sum(), -1)
        solved = np.linalg.lstsq(rows, right, rcond=None)[0]
        out[:, own] = solved[1:3].reshape(2, -1, 3)
        left += [np.sum((right - rows @ solved) ** 2) / (right.shape[1] * (seen.sum() - degree - 1))] * len(own)
    return out, float(np.sqrt(np.mean(left))) if left else 0.0


def _curve(points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The natural cubic spline through ``points (M, 3)``: finely sampled, its length so far, that at the points."""
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if not (chords > 0).all():
        raise InputError(f"markers {int(np.argmin(chords))} and the next are at one place in the first frame")
    (curve,), places = curves(points[None], _FINE)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    return curve, along, along[places]
