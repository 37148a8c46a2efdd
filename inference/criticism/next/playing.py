"""A shape made a motion that keeps a robot's limits, sample by sample as it is written."""

from pathlib import Path

import numpy as np

from ....core.arrays import FloatArray
from ....core.motion import Motion, inverse, multiply
from ....core.store import write_text
from .limits import Limits, angles
from .shapes import Shape

#: Digits after the point of what is written: nanometres, or the differences of samples would not be smooth.
_DIGITS = 9
_ATTEMPTS = 60
#: Times a limit that no scaling of a motion with its turns makes up for.
_FAR = 1e3


def play(shape: Shape, start: FloatArray, limits: Limits) -> Motion:
    """The motion of ``shape`` from ``start (G, 7)``, made smaller until it keeps the limits.

    They hold for the differences of its rounded samples, standstill before and after included.
    """
    count = round(limits.duration * limits.rate) + 1
    times = np.round(np.arange(count) / limits.rate, _DIGITS)
    scale, turn_scale = 1.0, 1.0 if limits.turn > 0 and limits.turn_speed > 0 else 0.0
    for _ in range(_ATTEMPTS):
        motion = Motion(times, np.round(shape.poses(times, start, scale, turn_scale), _DIGITS))
        moves, turns = excess(motion, limits)
        if moves <= 1.0 and turns <= 1.0:
            return motion
        if moves > _FAR and len(start) > 1 and turn_scale > 0:
            turn_scale = 0.0  # turning takes a gripper where the workspace is closed
            continue
        if moves > 1.0:
            scale *= 0.999 / moves
        if turns > 1.0 or (moves > 1.0 and len(start) > 1):  # turning a pair of grippers moves them, too
            turn_scale *= 0.999 / max(turns, moves)
    return Motion(times, np.round(shape.poses(times, start, 0.0, 0.0), _DIGITS))


def excess(motion: Motion, limits: Limits) -> tuple[float, float]:
    """The largest share that ``motion`` takes of any limit on how it moves, and of any on how it turns.

    A workspace that is closed on one side counts as kept within a nanometre.
    """
    peaks = peaks_of(motion)
    away = motion.poses[..., :3] - motion.poses[:1, :, :3]
    beyond = np.where(away > 0, away / np.maximum(limits.high, 1e-12), away / np.minimum(limits.low, -1e-12))
    beyond = np.where(np.abs(away) <= 1.5 * 10.0**-_DIGITS, 0.0, beyond)
    moves = max(peaks["speed"] / limits.speed, peaks["acceleration"] / limits.acceleration, float(beyond.max()))
    if limits.turn == 0 or limits.turn_speed == 0:
        return moves, 0.0 if peaks["turn"] < 1e-6 else np.inf
    turns = (
        peaks["turn"] / limits.turn,
        peaks["turn_speed"] / limits.turn_speed,
        peaks["turn_acceleration"] / limits.turn_acceleration,
    )
    return moves, max(turns)


def peaks_of(motion: Motion) -> dict[str, float]:
    """Largest speed, acceleration, angle, angular speed and acceleration [m, s, rad] by differences of samples."""
    steps = np.diff(motion.times)
    step = float(steps.min())
    poses = np.concatenate([motion.poses[:1], motion.poses, motion.poses[-1:]])
    gaps = np.concatenate([[step], steps, [step]])[:, None, None]
    velocity = np.diff(poses[..., :3], axis=0) / gaps
    change = multiply(poses[1:, :, 3:], inverse(poses[:-1, :, 3:]))
    change = np.where(change[..., :1] < 0, -change, change)
    turning = 2.0 * change[..., 1:] / gaps  # of a small angle
    away = multiply(poses[..., 3:], inverse(poses[:1, :, 3:]))
    return {
        "speed": _largest(velocity),
        "acceleration": _largest(np.diff(velocity, axis=0)) / step,
        "turn": float(angles(away).max()),
        "turn_speed": _largest(turning),
        "turn_acceleration": _largest(np.diff(turning, axis=0)) / step,
    }


def _largest(vectors: FloatArray) -> float:
    return float(np.linalg.norm(vectors, axis=-1).max())


def write_motion(motion: Motion, path: Path) -> None:
    """Write ``time,gripper,x,y,z,qw,qx,qy,qz`` [s, m, unit quaternion], which ``muslin import`` reads, too."""
    lines = ["time,gripper,x,y,z,qw,qx,qy,qz"]
    for time, poses in zip(motion.times, motion.poses, strict=True):
        for g, pose in enumerate(poses):
            lines.append(",".join([f"{time:.{_DIGITS}f}", str(g), *(f"{v:.{_DIGITS}f}" for v in pose)]))
    write_text(path, "\n".join(lines) + "\n")
