"""What the object does at every moment: it is held still, moves slowly or fast, flies freely, touches something."""

from collections.abc import Sequence

import numpy as np

from ....core.arrays import FloatArray, IntArray
from ....core.rollout import Trajectory
from ....core.scenario import STANDARD_GRAVITY, Scenario

#: Phases of motion and of contact; labels are indices into these.
MOTION = ("held still", "slow", "fast", "free flight")
CONTACT = ("in contact", "free of contact")
#: Shares of the highest speed up to which the object is held still, and up to which it is slow.
_STILL, _FAST = 0.05, 0.4
#: Below this the object is held still whatever its highest speed [m/s].
_CREEP = 0.01
#: A vertex touches what it is nearer to than this [m].
_NEAR = 0.01


def speeds(trajectory: Trajectory, scenario: Scenario) -> FloatArray:
    """Root mean square speed of the object's vertices ``(T,)`` [m/s]; the best prediction has it without noise."""
    velocity = np.gradient(trajectory.vertices, scenario.times, axis=0)
    return np.asarray(np.sqrt((velocity**2).sum(axis=2).mean(axis=1)))


def motion_limits(speed: Sequence[FloatArray]) -> tuple[float, float]:
    """Speeds [m/s] up to which an object is held still and up to which it is slow, of all recordings together."""
    highest = float(np.quantile(np.concatenate(speed), 0.95))
    still = max(_STILL * highest, _CREEP)
    return still, max(_FAST * highest, still)


def motion_labels(trajectory: Trajectory, scenario: Scenario, limits: tuple[float, float]) -> IntArray:
    """Index into :data:`MOTION` of every frame ``(T,)``.

    An object that no gripper holds flies freely while it touches nothing and its middle falls with more than half
    of gravity.
    """
    speed = speeds(trajectory, scenario)
    labels = np.digitize(speed, limits)
    if not scenario.grasps:
        middle = trajectory.vertices.mean(axis=1)[:, 2]
        fall = -np.gradient(np.gradient(middle, scenario.times), scenario.times)
        touching = contact_labels(trajectory, scenario) == 0
        labels = np.where((fall > 0.5 * STANDARD_GRAVITY) & ~touching.any(axis=1), 3, labels)
    return np.asarray(labels, np.int64)


def contact_labels(trajectory: Trajectory, scenario: Scenario) -> IntArray:
    """Index into :data:`CONTACT` of every vertex at every time ``(T, V)``."""
    frames, count = trajectory.vertices.shape[:2]
    flat = trajectory.vertices.reshape(-1, 3)
    near = np.zeros(len(flat), bool)
    for obstacle in scenario.obstacles:
        near |= obstacle.signed_distance(flat)[0] < _NEAR
    return np.where(near, 0, 1).reshape(frames, count)
