"""How far markers stand beside the axis of a rope, told by how their distances change as it bends."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import FloatArray
from ..beside import Beside, Natural, bent_by, closing_angles, curves, rope_frames
from ..errors import InputError
from ..measurement import Recording
from ..motion import Motion, rolled
from .marker_frames import APART, Frames
from .measured import LONGEST

#: Fewer frames with all markers, of all recordings, tell nothing.
_FEWEST = 20
#: What an offset may be expected to be [m]; it counts as this many frames do.
_USUAL, _WEIGHT = 0.01, 25.0
#: What a roll may be expected to be [rad], and the largest change of one in a step.
_USUAL_ROLL, _LARGEST_STEP = 0.5, 0.5
#: So many frames, one after the other, are off alike: they tell of rolls as much as one.
_ALIKE = 4.0
#: Rolls that change by less are told [rad].
_NEAR = 1e-3
_ROUNDS = 12
#: No distance is known better [m].
_LEAST = 1e-12
#: Distances that are further off than this many robust standard deviations hardly count.
_FAR = 3.0
#: Markers that stand further beside the axis than this are worth a word, root mean square [m].
_MATTERS = 0.005


def standing_off(recordings: Sequence[Recording]) -> float:
    """How far the markers of a rope stand beside its axis, root mean square [m].

    Zero where that is too little to matter, and where the recordings do not tell.
    """
    try:
        offsets = told_standoffs(recordings).beside.offsets
    except InputError:
        return 0.0
    away = float(np.sqrt(np.mean(np.sum(offsets**2, axis=1))))
    return away if away > _MATTERS else 0.0


def told_beside(recordings: Mapping[str, Recording], fit_on: Sequence[str]) -> tuple[Beside, dict[str, Recording]]:
    """Where the markers stand, told by the recordings ``fit_on``, and all, with grippers as they turn the rope.

    How they do is told by all of a recording that is fitted, and by how any other starts, as its velocities are.
    """
    fitted, others = list(fit_on), [n for n in recordings if n not in fit_on]
    _check_alike(list(recordings.values()))
    told = told_standoffs([recordings[n] for n in fitted])
    out = dict(recordings)
    for names, until in ((fitted, np.inf), (others, LONGEST)):
        out |= dict(zip(names, told.turned([recordings[n] for n in names], until), strict=True))
    return told.beside, out


@dataclass(frozen=True, eq=False)
class Standoffs:
    """Where the markers of a rope stand, and what tells how a gripper holds it.

    Args:
        beside: the places in the cross-sections.
        lengths: of the axis from each marker to the next ``(M - 1,)`` [m].
        spread: robust standard deviation of what they are seen off by [m].
        usual: root mean square of the rolls of either gripper ``(2,)`` [rad], see :meth:`rolls`.
    """

    beside: Beside
    lengths: FloatArray
    spread: float
    usual: FloatArray

    def rolls(self, recordings: Sequence[Recording], until: float = np.inf) -> FloatArray:
        """By how much both grippers are turned about the rope ``(R, 2)`` [rad], beyond what their poses say.

        A pose that is told by two markers, or of a rope put into the jaws by hand, does not say how the rope's material
        is turned in it. The markers' distances do: their :attr:`lengths` are kept where the frames are turned rightly.

        Args:
            recordings: of this rope.
            until: frames later than so long after the first are not looked at [s].
        """
        rolls = np.zeros((len(recordings), 2))
        frames = Frames.of(recordings, until)
        if not len(frames.points):
            return rolls
        keep = np.sqrt(_ALIKE) * self.spread / self.usual
        for _ in range(_ROUNDS):
            lengths, _, change = _lengths(self.beside, frames, rolls)
            off, steps = lengths - self.lengths, np.zeros_like(rolls)
            for r in np.unique(frames.owner):
                own = frames.owner == r
                gate = np.full(own.sum(), _gate(off[own], self.spread))
                steps[r] = _step(off[own], change[own], gate, keep, rolls[r])
            steps = np.clip(steps, -_LARGEST_STEP, _LARGEST_STEP)
            rolls += steps
            if np.abs(steps).max() < _NEAR:
                break
        return rolls

    def turned(self, recordings: Sequence[Recording], until: float = np.inf) -> list[Recording]:
        """The same recordings, whose grippers are turned by :meth:`rolls`."""
        if not recordings:
            return []
        axes, out = Frames.of(recordings).axes, []
        for recording, axis, roll in zip(recordings, axes, self.rolls(recordings, until), strict=True):
            motion = recording.gripper
            assert motion is not None  # or it would have been refused
            out.append(replace(recording, gripper=Motion(motion.times, rolled(motion.poses, axis, roll))))
        return out


def told_standoffs(recordings: Sequence[Recording]) -> Standoffs:
    r"""Where the markers of a rope stand, the same in all ``recordings``, and how each of them holds it.

    A rope keeps the lengths :math:`L_i` between the places of its markers. Of markers that stand :math:`d` beside the
    axis the distances do not: where it is bent by the curvature :math:`\kappa`, they are
    :math:`L_i (1 - \kappa \cdot d)`. So those offsets are taken, and those rolls of either gripper in each recording,
    that leave the lengths of the axis least scatter, by Gauss-Newton steps with weights that fall off as of a normal
    distribution. Twist is spread evenly, or as in a rope that keeps the bend that it mostly has: whichever leaves less.
    The first two markers, and the last two, are taken to stand alike: between them a rope that is clamped does not
    bend, so nothing else tells them apart. Nothing is simulated.

    Raises:
        InputError: not markers in order between two grippers, or too few frames show all of them.
    """
    _check_alike(recordings)
    frames = Frames.of(recordings)
    if len(frames.points) < _FEWEST:
        raise InputError(
            f"[scenario.markers] = 'beside' tells from frames that show every marker where they stand, but of "
            f"{', '.join(r.name for r in recordings)} only {len(frames.points)} do, {APART:g} s apart; at least "
            f"{_FEWEST} are needed: leave it out, or fit on more recordings"
        )
    angles = closing_angles(curves(frames.points)[0], frames.poses)
    turn = float(np.angle(np.mean(np.exp(1j * angles))))  # no rope is twisted for good
    none = Beside(np.zeros((frames.points.shape[1], 2)), turn)
    even, rolls = _told(none, np.zeros((len(recordings), 2)), frames)
    kept, _ = _told(replace(even.beside, natural=_natural(even.beside, frames, rolls)), rolls, frames)
    return min(even, kept, key=lambda told: told.spread)


def _check_alike(recordings: Sequence[Recording]) -> None:
    counts = {r.name: r.series.points.shape[1] for r in recordings}
    if len(set(counts.values())) > 1:
        told = ", ".join(f"{name} has {count}" for name, count in counts.items())
        raise InputError(f"[scenario.markers] = 'beside' is for recordings of the same markers, but {told}")


def _told(found: Beside, rolls: FloatArray, frames: Frames) -> tuple[Standoffs, FloatArray]:
    """What is told from a first guess on, and the rolls; a curvature that is kept is told anew in every round."""
    for _ in range(_ROUNDS):
        before = rolls
        found, rolls, lengths, spread = _stepped(found, rolls, frames)
        if found.natural is not None:
            found = replace(found, natural=_natural(found, frames, rolls))
        if 0.0 < np.abs(rolls - before).max() < _NEAR:
            break
    usual = np.sqrt((_USUAL_ROLL**2 + np.sum(rolls**2, axis=0)) / (1 + len(rolls)))
    return Standoffs(found, lengths, spread, usual), rolls


def _stepped(now: Beside, rolls: FloatArray, frames: Frames) -> tuple[Beside, FloatArray, FloatArray, float]:
    """Offsets, rolls ``(R, 2)``, lengths and their spread after one Gauss-Newton step."""
    lengths, by_offsets, by_rolls = _lengths(now, frames, rolls)
    inner = now.offsets[1:-1].ravel()
    known = np.median(lengths, axis=0)
    off = lengths - known
    spread = max(1.4826 * float(np.median(np.abs(off))), _LEAST)
    own = np.zeros((*lengths.shape, *rolls.shape))
    own[np.arange(len(off)), :, frames.owner] = by_rolls
    by_offsets[:, :, 1] += by_offsets[:, :, 0]
    by_offsets[:, :, -2] += by_offsets[:, :, -1]
    change = np.concatenate([by_offsets[:, :, 1:-1].reshape(*off.shape, -1), own.reshape(*off.shape, -1)], axis=2)
    change -= change.mean(axis=0)  # the lengths are not known either
    keep = np.sqrt(_WEIGHT) * spread / np.repeat([_USUAL, _USUAL_ROLL], [len(inner), rolls.size])
    gates, seen = np.zeros(len(rolls)), np.unique(frames.owner)
    gates[seen] = [_gate(off[frames.owner == r], spread) for r in seen]
    step = _step(off, change, gates[frames.owner], keep, np.concatenate([inner, rolls.ravel()]))
    offsets = (inner + step[: len(inner)]).reshape(-1, 2)
    turns = np.clip(step[len(inner) :].reshape(rolls.shape), -_LARGEST_STEP, _LARGEST_STEP)
    # what all recordings are rolled by is where the markers stand: no rope is twisted for good
    rolls = rolls + turns
    common = rolls[seen].mean(axis=0)
    rolls[seen] -= common  # those that show no frame stay at zero
    so_far = np.concatenate([[0.0], np.cumsum(known)])
    angle = common[0] + (common[1] - common[0]) * so_far / so_far[-1]
    x, y = np.concatenate([offsets[:1], offsets, offsets[-1:]]).T
    told = np.stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y], axis=1)
    return replace(now, offsets=told), rolls, known, spread


def _natural(beside: Beside, frames: Frames, rolls: FloatArray) -> Natural:
    """The curvature that the rope has in the median, in the axes of its material: what moves it differs, this stays."""
    poses = frames.turned(rolls)
    curve, _ = curves(beside.axis(frames.points, poses, frames.firsts))
    axes = rope_frames(curve, poses, beside.turn, beside.natural, frames.firsts)
    bends, lengths = bent_by(curve, axes[:, :, 0], axes[:, :, 1])
    so_far = np.cumsum(lengths, axis=1)
    shares = (so_far / so_far[:, -1:]).mean(axis=0)[:-1]
    return Natural(shares, np.median(bends, axis=0))


def _lengths(beside: Beside, frames: Frames, rolls: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """From marker to marker along the axis ``(N, M - 1)`` [m], and how they change.

    With small changes of the offsets ``(N, M - 1, M, 2)``, and of the rolls ``(N, M - 1, 2)``.
    """
    poses = frames.turned(rolls)
    axis = beside.axis(frames.points, poses, frames.firsts)
    curve, places = curves(axis)
    so_far = np.cumsum(np.linalg.norm(np.diff(curve, axis=1), axis=2), axis=1)
    so_far = np.concatenate([np.zeros((len(axis), 1)), so_far], axis=1)[:, places]
    axes = beside.frames(axis, poses, frames.firsts)
    chords = np.diff(axis, axis=1)
    chords /= np.linalg.norm(chords, axis=2, keepdims=True)
    count = axis.shape[1]
    slopes = np.zeros((len(axis), count - 1, count, 2))
    k = np.arange(count - 1)
    slopes[:, k, k] = np.einsum("tkx,tkax->tka", chords, axes[:, :-1])
    slopes[:, k, k + 1] = -np.einsum("tkx,tkax->tka", chords, axes[:, 1:])
    x, y = beside.offsets.T  # an offset turns with its cross-section
    turned = np.einsum("tkma,ma->tkm", slopes, np.stack([-y, x], axis=1))
    by_rolls = turned @ beside.twist_by_grippers(axis, poses, frames.firsts)
    return np.diff(so_far, axis=1), slopes, by_rolls


def _gate(off: FloatArray, spread: float) -> float:
    """Beyond what distances of one recording hardly count [m]: its own spread, lest it is left as it is."""
    return _FAR * max(spread, 1.4826 * float(np.median(np.abs(off))))


def _step(off: FloatArray, change: FloatArray, gate: FloatArray, keep: FloatArray, now: FloatArray) -> FloatArray:
    """The step that takes ``off (T, K)`` to zero in the least squares, where ``change (T, K, N)`` is its slope.

    Weights fall off beyond ``gate (T,)``, and what is told, ``now (N,)``, is kept small by ``keep (N,)``.
    """
    weight = np.exp(-0.25 * (off / gate[:, None]) ** 2)
    rows = (change * weight[..., None]).reshape(off.size, -1)
    whole = np.concatenate([rows, np.diag(keep)])
    return np.asarray(np.linalg.lstsq(whole, np.concatenate([-(off * weight).ravel(), -keep * now]), rcond=None)[0])
