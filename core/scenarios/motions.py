"""Built-in commands of the grippers."""

from collections.abc import Sequence

import numpy as np

from ..arrays import FloatArray
from ..body import Body
from ..motion import Motion

RATE = 100.0  # of built-in commands [Hz]
#: Radius of the spool of ``winding`` and height of its axis [m].
SPOOL_RADIUS, SPOOL_HEIGHT = 0.04, 1.0
#: Height of a gripper that holds cloth which lies on a table at z = 0 [m].
LEVEL = 0.001


def smooth_path(knots: Sequence[tuple[float, float, float, float]], tail: float = 0.0) -> Motion:
    """A gripper through ``(time, x, y, z)`` knots, at rest in each (minimum-jerk between them)."""
    k = np.array(knots, float)
    times = _clock(k[-1, 0] + tail)
    right = np.clip(np.searchsorted(k[:, 0], times, side="right"), 1, len(k) - 1)
    blend = _jerkless((times - k[right - 1, 0]) / (k[right, 0] - k[right - 1, 0]))[:, None]
    return Motion.from_positions(times, (k[right - 1, 1:] + blend * (k[right, 1:] - k[right - 1, 1:]))[:, None])


def swing_motion(
    amplitude: float = 0.10, frequency: float = 0.9, cycles: float = 2.0, along: Sequence[float] = (0.3, 1.0, 0.0)
) -> Motion:
    """To and fro along a horizontal direction, growing from rest over the first half cycle."""
    times = _clock(cycles / frequency)
    direction = np.asarray(along, float) / np.linalg.norm(along)
    positions = _swing(times, amplitude, frequency)[:, None] * direction + np.array([0.0, 0.0, 1.0])
    return Motion.from_positions(times, positions[:, None])


def fling_motion(reach: float = 0.22, height: float = 0.15, duration: float = 0.55, tail: float = 0.7) -> Motion:
    """Up and forward, stop, and back down: the cloth unfolds ahead of the grippers and falls back."""
    return smooth_path([(0, 0, 0, 1.0), (duration, 0, reach, 1.0 + height), (2 * duration, 0, -0.3 * reach, 1.0)], tail)


def lift_motion() -> Motion:
    """Straight up and to rest."""
    return smooth_path([(0, 0, 0, 0.6), (0.8, 0, 0, 1.0)], 0.8)


def still_motion() -> Motion:
    """Held at one place for two seconds."""
    return smooth_path([(0, 0, 0, 1.0), (2.0, 0, 0, 1.0)])


def carry_motion() -> Motion:
    """Through the air to another place, round a corner."""
    return smooth_path([(0, 0, 0, 1.0), (0.9, 0.25, 0.15, 1.1), (1.8, -0.1, 0.3, 0.95)], 0.6)


def wiping_motion(body: Body) -> Motion:
    """Over the table: away from the cloth by 0.7 of its length, then sideways by half its length."""
    size = float(np.ptp(body.vertices, axis=0).max())
    return smooth_path(
        [(0, 0, 0, LEVEL), (1.2, 0, 0.7 * size, LEVEL), (2.2, 0.5 * size, 0.7 * size, LEVEL)],
        0.3,
    )


def fold_motion(body: Body) -> Motion:
    """Half a circle over the cloth, from its leading edge to just above the opposite one, and a rest."""
    length = float(np.ptp(body.vertices, axis=0)[1])
    times = _clock(2.4)
    angle = np.pi * _jerkless(times / 1.8)
    above = LEVEL + 0.009 * (1.0 - np.cos(angle)) / 2  # lies on the lower layer in the end, not in it
    y, z = 0.5 * length * (np.cos(angle) - 1.0), above + 0.5 * length * np.sin(angle)
    return Motion.from_positions(times, np.stack([0.0 * times, y, z], axis=1)[:, None])


def cable_motion(body: Body) -> Motion:
    """Two grippers, 0.7 of the cable's length apart, swing across it out of step and draw nearer."""
    apart = 0.7 * float(body.measures.sum())
    times = _clock(2.2)
    nearer = apart * (1.0 - 0.25 * _jerkless(times / 2.0))
    still, high = 0.0 * times, np.full_like(times, 1.0)
    first = np.stack([still, _swing(times, 0.07, 0.9), high], axis=1)
    second = np.stack([nearer, -_swing(times, 0.04, 1.1), high], axis=1)
    return Motion.from_positions(times, np.stack([first, second], axis=1))


def winding_motion(body: Body) -> Motion:
    """Round the spool by 1.25 turns, a little along it, the gripper turning with the rope.

    The path is the involute of the spool: what is between spool and gripper grows shorter by what lies on
    the spool, so that the rope need not slip. A rope too short for that is wound less far.
    """
    radius = SPOOL_RADIUS + 0.004  # of the centre line of a rope on it
    length = float(body.measures.sum())
    free = 0.5 * length
    angle = min(2.5 * np.pi, 0.8 * free / radius)
    times = _clock(4.5)
    turned = angle * _jerkless(times / 4.0)
    left = (free - radius * turned)[:, None]
    sin, cos, nothing = np.sin(turned), np.cos(turned), 0.0 * turned
    outward, along = np.stack([sin, nothing, cos], axis=1), np.stack([cos, nothing, -sin], axis=1)
    position = radius * outward + left * along + np.array([0.0, 0.0, SPOOL_HEIGHT])
    position[:, 1] += 0.015 * turned / (2 * np.pi)
    turn = np.stack([np.cos(turned / 2), nothing, np.sin(turned / 2), nothing], axis=1)
    return Motion(times, np.concatenate([position, turn], axis=1)[:, None])


def _clock(duration: float) -> FloatArray:
    return np.arange(0.0, duration + 0.5 / RATE, 1.0 / RATE)


def _jerkless(share: FloatArray) -> FloatArray:
    """From 0 to 1 with minimal jerk (Flash and Hogan 1985), as ``share`` of the time goes from 0 to 1."""
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s**3 * (10 - 15 * s + 6 * s**2))


def _swing(times: FloatArray, amplitude: float, frequency: float) -> FloatArray:
    grow = np.clip(times * frequency * 2.0, 0, 1)
    return np.asarray(amplitude * grow**2 * (3 - 2 * grow) * np.sin(2 * np.pi * frequency * times))
