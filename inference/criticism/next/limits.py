"""What a robot may do: speed, acceleration, workspace, turning, and for how long."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

from ....core.arrays import FloatArray
from ....core.errors import InputError
from ....core.motion import Motion, inverse, multiply
from ....core.scenario import Scenario

#: What a robot can do at least, where the recordings hardly move it [m/s, m/s2, m].
LEAST_SPEED, LEAST_ACCELERATION, LEAST_REACH = 0.3, 3.0, 0.1
#: Recorded poses are smoothed over this time before their speed and acceleration are taken [s].
SMOOTHED = 0.12
#: Grippers that turn by less than this do not turn [rad].
LEAST_TURN = 0.05
#: How long a motion may last [s]: the shortest and the longest that make sense.
SHORTEST, LONGEST = 0.3, 60.0


@dataclass(frozen=True)
class Limits:
    """Bounds that hold for every gripper at every sample of a motion.

    Args:
        speed: [m/s].
        acceleration: [m/s2].
        workspace: least and greatest displacement from the start pose, x0 x1 y0 y1 z0 z1 [m].
        turn: angle from the start pose [rad].
        turn_speed: [rad/s]; the angular acceleration may be this times ``acceleration / speed`` [rad/s2].
        duration: of a motion, the rest at its end included [s].
        rate: of the samples [Hz].

    Raises:
        InputError: a limit that no motion can keep.
    """

    speed: float
    acceleration: float
    workspace: tuple[float, float, float, float, float, float]
    turn: float
    turn_speed: float
    duration: float
    rate: float = 100.0

    def __post_init__(self) -> None:
        for what, value in [("speed", self.speed), ("acceleration", self.acceleration), ("rate", self.rate)]:
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"the {what} of the next motion must be above zero, but is {value:g}")
        if not 0 <= self.turn <= np.pi or not (np.isfinite(self.turn_speed) and self.turn_speed >= 0):
            raise InputError(
                f"the next motion may turn by 0 to {np.pi:.4g} rad at 0 rad/s or more, "
                f"but the limits are {self.turn:g} rad and {self.turn_speed:g} rad/s"
            )
        if not SHORTEST <= self.duration <= LONGEST:
            raise InputError(
                f"the next motion must take {SHORTEST:g} to {LONGEST:g} s, but its duration is {self.duration:g} s"
            )
        if self.duration * self.rate < 10:
            raise InputError(f"{self.rate:g} Hz are too few for a motion of {self.duration:g} s; use at least 20 Hz")
        for axis, low, high in zip("xyz", self.low, self.high, strict=True):
            if not (np.isfinite(low) and np.isfinite(high)) or not low <= 0 <= high:
                raise InputError(
                    f"the workspace is relative to the pose where the recordings start, so {axis}0 must not be above "
                    f"0 nor {axis}1 below 0, but they are {low:g} and {high:g} m"
                )

    @property
    def low(self) -> FloatArray:
        """``(3,)`` [m]."""
        return np.array(self.workspace[0::2])

    @property
    def high(self) -> FloatArray:
        """``(3,)`` [m]."""
        return np.array(self.workspace[1::2])

    @property
    def turn_acceleration(self) -> float:
        """[rad/s2]."""
        return self.turn_speed * self.acceleration / self.speed

    def as_dict(self) -> dict[str, Any]:
        return {**asdict(self), "workspace": list(self.workspace)}

    def text(self) -> str:
        """For people."""
        box = ", ".join(f"{a} {lo:.2f} to {hi:.2f}" for a, lo, hi in zip("xyz", self.low, self.high, strict=True))
        turning = f", turning by up to {np.degrees(self.turn):.0f}° at {self.turn_speed:.1f} rad/s" if self.turn else ""
        return (
            f"{self.speed:.2g} m/s, {self.acceleration:.2g} m/s², {box} m from the start pose{turning}, "
            f"{self.duration:.2g} s"
        )


def limits_within(
    scenarios: Iterable[Scenario],
    *,
    max_speed: float | None = None,
    max_acceleration: float | None = None,
    workspace: Sequence[float] | None = None,
    max_turn: float | None = None,
    max_turn_speed: float | None = None,
    duration: float | None = None,
    rate: float = 100.0,
) -> Limits:
    """What is asked for, and otherwise what the recordings show that the robot can do.

    Where they hardly move it, :data:`LEAST_SPEED` and its kin; beside obstacles it reaches no lower or farther
    than it did, but for upwards.

    Args:
        scenarios: of the recordings, each as it was moved in one go.
        max_speed, max_acceleration, workspace, max_turn, max_turn_speed, duration, rate: as of :class:`Limits`.
    """
    scenarios = list(scenarios)
    speed, acceleration, turn, turn_speed = LEAST_SPEED, LEAST_ACCELERATION, 0.0, 0.0
    free = not any(s.obstacles for s in scenarios)
    low = np.full(3, -LEAST_REACH if free else 0.0)
    high = np.full(3, LEAST_REACH) if free else np.array([0.0, 0.0, LEAST_REACH])
    lasts = 0.0
    for s in scenarios:
        start, end = float(s.times[0]), float(s.times[-1])
        lasts = max(lasts, end - start)
        fastest, strongest, away, angle, turning = _recorded(s.motion, start, end)
        speed, acceleration = max(speed, fastest), max(acceleration, strongest)
        low, high = np.minimum(low, away.min(axis=(0, 1))), np.maximum(high, away.max(axis=(0, 1)))
        turn, turn_speed = max(turn, angle), max(turn_speed, turning)
    box = np.stack([low, high], axis=1).ravel() if workspace is None else np.asarray(workspace, float)
    if box.shape != (6,):
        raise InputError(f"the workspace needs six numbers, x0 x1 y0 y1 z0 z1 [m], but has {box.size}")
    turn = max_turn if max_turn is not None else (turn if turn >= LEAST_TURN else 0.0)
    return Limits(
        speed=max_speed if max_speed is not None else speed,
        acceleration=max_acceleration if max_acceleration is not None else acceleration,
        workspace=(float(box[0]), float(box[1]), float(box[2]), float(box[3]), float(box[4]), float(box[5])),
        turn=turn,
        # a turn that is allowed without a speed: as fast as takes it there in half a second
        turn_speed=max_turn_speed if max_turn_speed is not None else max(turn_speed, 2.0 * turn),
        duration=duration if duration is not None else float(np.clip(lasts, 1.0, 5.0)),
        rate=rate,
    )


def _recorded(motion: Motion, start: float, end: float) -> tuple[float, float, FloatArray, float, float]:
    """Speed, acceleration, displacements ``(K, G, 3)`` [m], angle and angular speed that a motion reached."""
    step = SMOOTHED / 8
    times = np.arange(start, max(end, start + 2 * SMOOTHED), step)
    poses = motion.at(times)
    velocity = savgol_filter(poses[..., :3], 9, 3, deriv=1, delta=step, axis=0, mode="nearest")
    change = savgol_filter(poses[..., :3], 9, 3, deriv=2, delta=step, axis=0, mode="nearest")
    away = poses[..., :3] - poses[:1, :, :3]
    angle = angles(multiply(poses[..., 3:], inverse(poses[:1, :, 3:])))
    turning = angles(multiply(poses[8:, :, 3:], inverse(poses[:-8, :, 3:]))) / SMOOTHED
    top = [float(np.linalg.norm(v, axis=-1).max()) for v in (velocity, change)]
    return top[0], top[1], away, float(angle.max()), float(turning.max())


def angles(quaternions: FloatArray) -> FloatArray:
    """Angles ``(...)`` [rad], 0 to pi, of the turns ``(..., 4)``."""
    vector = np.linalg.norm(quaternions[..., 1:], axis=-1)
    return np.asarray(2.0 * np.arctan2(vector, np.abs(quaternions[..., 0])))
