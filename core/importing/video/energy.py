"""How far two clocks are apart, told from motion: where much moves in the picture, the gripper is fast."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...arrays import FloatArray
from ...frames import Frames
from ...motion import Motion

#: Below this correlation the motion in the picture is not that of the gripper: an object that swings on, or is wound
#: up late, agrees by less at a wrong offset. The robot's mask, if there is one, shows the gripper alone.
FAINT = 0.8
#: Nor is it below so many standard errors of Fisher's z: short signals agree by chance.
ERRORS = 4.0
#: Motion must raise the change from frame to frame by this share; the noise of a camera alone raises it by less.
RAISED = 0.1
#: A second peak as high as this share of the first leaves open which it is.
RIVAL = 0.9
#: So much of the shorter signal must lie within the longer.
OVERLAP = 0.6
#: Rows and columns of the pictures that are compared, at most.
_GRID = 96


@dataclass(frozen=True)
class Offset:
    """What to add to the time of the frames [s], how well both then agree (1 is all), and whether that is clear."""

    offset: float
    correlation: float
    reason: str = ""

    @property
    def clear(self) -> bool:
        return not self.reason


def motion_energy(frames: Frames) -> FloatArray:
    """Mean change from frame to frame ``(T - 1,)``: of the robot's mask where there is one, else of brightness."""
    step = max(1, -(-max(frames.rgb.shape[1:3]) // _GRID))
    if frames.robot is not None and frames.robot.any():
        layer = frames.robot[:, ::step, ::step].astype(np.float32)
    else:
        layer = frames.rgb[:, ::step, ::step].astype(np.float32).mean(axis=3)
    return np.array([np.abs(b - a).mean() for a, b in pairwise(layer)], float)


def estimated_offset(time: FloatArray, frames: Frames, gripper: Motion) -> Offset:
    """The shift at which motion in the pictures and speed of the grippers correlate most.

    Args:
        time: of the frames ``(T,)`` [s], on their own clock.
        frames: T of them.
        gripper: poses on theirs.
    """
    if len(time) < 8 or len(gripper.times) < 3:
        return Offset(0.0, 0.0, "there are too few frames or poses")
    # half a frame is as fine as the pictures tell; the peak is placed between
    dt = 0.5 * float(np.median(np.diff(time)))
    begin, seen = _even(time, motion_energy(frames) / np.diff(time), dt)
    low, high = np.quantile(seen, [0.1, 0.95])
    if high <= (1.0 + RAISED) * low:
        return Offset(0.0, 0.0, "hardly anything moves in the pictures")
    steps = np.linalg.norm(np.diff(gripper.poses[..., :3], axis=0), axis=2).mean(axis=1)
    start, done = _even(gripper.times, steps / np.diff(gripper.times), dt)
    if done.std() < 1e-9:
        return Offset(0.0, 0.0, "the gripper does not change its speed")
    lags, curve = _correlations(seen, done)
    if not np.isfinite(curve).any():
        return Offset(0.0, 0.0, "frames and poses are too short")
    best = int(np.nanargmax(curve))
    top = float(curve[best])
    offset = start - begin + dt * (lags[best] + _vertex(curve, best))
    # what changes between two frames is one sample, of four steps, as neighbours go together
    samples = max(1.0, 0.25 * min(len(seen), len(done)) - 3.0)
    if top < max(FAINT, float(np.tanh(ERRORS / np.sqrt(samples)))):
        return Offset(offset, top, f"at best they correlate by {top:.2f}")
    far = np.abs(lags - lags[best]) > _width(curve, best)
    rival = float(np.nanmax(np.where(far, curve, -1.0)))
    if rival > RIVAL * top:
        other = start - begin + dt * float(lags[int(np.nanargmax(np.where(far, curve, -1.0)))])
        return Offset(offset, top, f"{offset:+.3f} s and {other:+.3f} s fit alike")
    return Offset(offset, top)


def _even(times: FloatArray, rates: FloatArray, dt: float) -> tuple[float, FloatArray]:
    """Rates between times, at even steps from the first on: when they begin, and what they are."""
    middle = 0.5 * (times[1:] + times[:-1])
    grid = np.arange(middle[0], middle[-1] + 1e-9, dt)
    return float(middle[0]), np.interp(grid, middle, rates)


def _correlations(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Pearson's correlation of ``a[k]`` and ``b[k + lag]`` over what overlaps, for every lag that overlaps enough."""
    least = max(4, int(OVERLAP * min(len(a), len(b))))
    lags = np.arange(least - len(a), len(b) - least + 1)
    curve = np.full(len(lags), np.nan)
    for k, lag in enumerate(lags):
        x, y = a[max(0, -lag) : len(b) - lag], b[max(0, lag) : len(a) + lag]
        # where one hardly moves, noise decides
        if x.std() > 0.3 * a.std() and y.std() > 0.3 * b.std():
            curve[k] = np.corrcoef(x, y)[0, 1]
    return lags.astype(float), curve


def _vertex(curve: FloatArray, k: int) -> float:
    """Where between its neighbours the peak ``k`` lies, by the parabola through the three."""
    if not 0 < k < len(curve) - 1 or not np.isfinite(curve[k - 1 : k + 2]).all():
        return 0.0
    left, middle, right = curve[k - 1 : k + 2]
    bend = left - 2.0 * middle + right
    return 0.0 if bend >= 0 else float(0.5 * (left - right) / bend)


def _width(curve: FloatArray, k: int) -> float:
    """How far [steps] from its peak the curve first falls to half."""
    low = np.flatnonzero(~(curve > 0.5 * curve[k]))
    return float(np.abs(low - k).min()) if len(low) else float(len(curve))
