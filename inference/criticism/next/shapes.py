"""Shapes of motions: a family to search, and ready-made ones."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from ....core.arrays import FloatArray
from ....core.motion import Motion, inverse, multiply, rotate
from ....core.scenario import Scenario
from ....core.scenarios import preset
from .limits import Limits

#: Built-in scenarios whose commands need no particular object.
READY_MADE = ("fling", "swing", "lift", "hang", "carry")
#: Motions as they were recorded are smoothed with this standard deviation, and begin and end at rest within this [s].
_SMOOTH, _EASE = 0.03, 0.15
#: The smallest amplitude worth shaking with [m]: it bounds the frequencies.
_LEAST_AMPLITUDE = 0.005


class Shape(ABC):
    """Where grippers go from a start pose, before the limits of the robot are applied.

    Attributes:
        name: for people.
    """

    name: str

    @abstractmethod
    def poses(self, times: FloatArray, start: FloatArray, scale: float, turn_scale: float) -> FloatArray:
        """Poses ``(K, G, 7)`` at ``times (K,)`` [s] from 0 on; at 0 they are ``start (G, 7)``.

        Args:
            times: [s].
            start: poses of the grippers.
            scale: of displacements; 0 does not move.
            turn_scale: of angles.
        """

    @abstractmethod
    def varied(self, size: float, rng: np.random.Generator) -> "Shape":
        """A shape like this one, changed by about ``size`` of what shapes of its kind can differ by."""


@dataclass(frozen=True, eq=False)
class Drawn(Shape):
    """A member of the family: strokes, a swing whose frequency sweeps, a turn to and fro, and a rest at the end.

    Every part begins and ends at rest (minimum jerk). All grippers move as one rigid body about the middle between
    them, so they keep their distances.

    Args:
        unit: where in the family ``(SIZE,)``, 0 to 1: swing amplitude x y z, phase between the axes, first and last
            frequency, when the swing begins, stroke x y z, number of strokes, share of the time that is motion,
            intensity, turn, its frequency, its axis.
        limits: that say how far and how fast.
        fastest: frequency [Hz].
    """

    unit: FloatArray
    limits: Limits
    fastest: float

    SIZE: ClassVar[int] = 16

    @property
    def active(self) -> float:
        """Duration without the rest [s]."""
        return self.limits.duration * float(0.4 + 0.5 * self.unit[11])

    @property
    def intensity(self) -> float:
        return float(0.35 + 0.65 * self.unit[12])

    @property
    def strokes(self) -> int:
        """How often it goes to the other end of the stroke."""
        return int(min(4, np.floor(5 * self.unit[10])))

    @property
    def axis(self) -> int:
        """About which it turns: 0 to 2 for x to z."""
        return int(min(2, np.floor(3 * self.unit[15])))

    def _frequency(self, share: float) -> float:
        slowest = min(1.0 / self.active, 0.5 * self.fastest)
        return float(slowest * (self.fastest / slowest) ** share)

    @property
    def swing(self) -> FloatArray:
        """Amplitudes ``(3,)`` [m]: no more than its frequency lets the robot make."""
        rate = 2 * np.pi * max(self.frequencies)
        possible = min(self.limits.speed / rate, self.limits.acceleration / rate**2)
        reach = np.minimum(0.5 * (self.limits.high - self.limits.low), possible)
        return np.asarray(self.intensity * reach * _or_none(self.unit[:3]))

    @property
    def middle(self) -> FloatArray:
        """About which it swings ``(3,)`` [m], so that a workspace that is narrow on one side is kept."""
        room = np.maximum(self.limits.high - self.limits.low, 1e-12)
        return np.asarray(np.abs(self.swing) * (self.limits.high + self.limits.low) / room)

    @property
    def stroke(self) -> FloatArray:
        """``(3,)`` [m]."""
        share = _or_none(self.unit[7:10])
        reach = np.where(share > 0, self.limits.high, -self.limits.low)
        return np.asarray((self.strokes > 0) * self.intensity * reach * share)

    @property
    def frequencies(self) -> tuple[float, float]:
        """Of the swing, first and last [Hz]."""
        return self._frequency(float(self.unit[4])), self._frequency(float(self.unit[5]))

    @property
    def turn(self) -> float:
        """Amplitude [rad]: no more than its frequency lets the robot make."""
        rate = 2 * np.pi * self._frequency(float(self.unit[14]))
        possible = min(self.limits.turn, self.limits.turn_speed / rate, self.limits.turn_acceleration / rate**2)
        return float(possible * self.intensity * (2.0 * self.unit[13] - 1.0))

    @property
    def name(self) -> str:  # type: ignore[override]
        parts = []
        if self.stroke.any():
            size = float(np.linalg.norm(self.stroke))
            parts.append(f"{self.strokes} stroke{'s' * (self.strokes > 1)} of {size:.2f} m along {_along(self.stroke)}")
        if self.swing.any():
            first, last = self.frequencies
            parts.append(f"a swing along {_along(self.swing)} from {first:.2g} to {last:.2g} Hz")
        if self.turn:
            parts.append(f"turning about {'xyz'[self.axis]} at {self._frequency(float(self.unit[14])):.2g} Hz")
        return ", ".join([*parts, f"{self.active:.1f} s"]) + ", then at rest"

    def varied(self, size: float, rng: np.random.Generator) -> "Drawn":
        moved = self.unit + size * rng.standard_normal(self.SIZE) * (rng.random(self.SIZE) < 0.5)
        return replace(self, unit=np.clip(np.abs(moved), 0.0, 1.0))

    def poses(self, times: FloatArray, start: FloatArray, scale: float, turn_scale: float) -> FloatArray:
        begin = 0.5 * float(self.unit[6]) * self.active
        first, last = self.frequencies
        into = np.clip(times - begin, 0.0, self.active - begin)
        window = _bump(into / (self.active - begin))[:, None]
        sweep = first * into + 0.5 * (last - first) * into**2 / (self.active - begin)
        phase = 2 * np.pi * sweep[:, None] + np.pi * float(self.unit[3]) * np.arange(3)
        away = window * (np.sin(phase) * self.swing + self.middle)
        if self.strokes:
            number = np.clip(self.strokes * times / self.active, 0.0, self.strokes - 1e-9)
            done, blend = np.floor(number), _minimum_jerk(number - np.floor(number))
            blend = np.where(times >= self.active, 1.0, blend)
            away = away + np.where(done % 2 == 0, blend, 1.0 - blend)[:, None] * self.stroke
        at = np.clip(times / self.active, 0.0, 1.0)
        angle = self.turn * _bump(at) * np.sin(2 * np.pi * self._frequency(float(self.unit[14])) * at * self.active)
        turns = _quaternions(turn_scale * angle[:, None] * np.eye(3)[self.axis])
        middle = start[:, :3].mean(axis=0)
        positions = middle + scale * away[:, None] + rotate(turns[:, None], start[None, :, :3] - middle)
        return np.concatenate([positions, multiply(turns[:, None], start[None, :, 3:])], axis=-1)


@dataclass(frozen=True, eq=False)
class Known(Shape):
    """A motion that exists already, from another start; grippers that it does not have follow its first one.

    Args:
        title: for people.
        motion: that is followed.
        begin, end: of what is followed of it [s].
        limits: what lasts longer is made faster, and where the workspace is closed on a side it does not go there.
        recorded: it was recorded in the study already.
        pace: times as fast.
        size: times as large.
        heading: turned about the vertical [rad].
    """

    title: str
    motion: Motion
    begin: float
    end: float
    limits: Limits
    recorded: bool = False
    pace: float = 1.0
    size: float = 1.0
    heading: float = 0.0

    @property
    def name(self) -> str:  # type: ignore[override]
        told = [self.title]
        if self.pace != 1.0:
            told.append(f"{self.pace:.2f} times as fast")
        if self.size != 1.0:
            told.append(f"up to {self.size:.2f} times as large")
        if self.heading:
            told.append(f"turned by {np.degrees(self.heading):.0f}° about z")
        return ", ".join(told)

    def varied(self, size: float, rng: np.random.Generator) -> "Known":
        pace, large, heading = size * rng.standard_normal(3)
        return replace(
            self,
            recorded=False,
            pace=self.pace * float(np.exp(2.0 * pace)),
            size=self.size * float(np.exp(2.0 * large)),
            heading=self.heading + float(np.pi * heading),
        )

    def poses(self, times: FloatArray, start: FloatArray, scale: float, turn_scale: float) -> FloatArray:
        pace = self.pace * max(1.0, (self.end - self.begin) / self.limits.duration)
        their = self.motion.at(np.minimum(self.begin + pace * times, self.end))
        which = [g if g < their.shape[1] else 0 for g in range(len(start))]
        their = their[:, which]
        away = their[..., :3] - their[:1, :, :3]
        turned = multiply(their[..., 3:], inverse(their[:1, :, 3:]))
        vectors = Rotation.from_quat(np.roll(turned, -1, axis=-1).reshape(-1, 4)).as_rotvec().reshape(away.shape)
        about = np.array([np.cos(self.heading / 2), 0.0, 0.0, np.sin(self.heading / 2)])
        away, vectors = rotate(about, self.size * away), rotate(about, vectors)
        away = np.where((away < 0) & (self.limits.low == 0) | (away > 0) & (self.limits.high == 0), 0.0, away)
        smooth = _SMOOTH / float(np.median(np.diff(times)))
        away, vectors = (gaussian_filter1d(v, smooth, axis=0, mode="nearest") for v in (away, vectors))
        away, vectors = _eased(times, away), _eased(times, vectors)
        turns = _quaternions(turn_scale * vectors)
        return np.concatenate([start[None, :, :3] + scale * away, multiply(turns, start[None, :, 3:])], axis=-1)


def known_shapes(scenarios: Mapping[str, Scenario], limits: Limits) -> list[Known]:
    """The recordings' own motions, once more, and the ready-made ones."""
    out = [
        Known(f"{name} once more", s.motion, float(s.times[0]), float(s.times[-1]), limits, True)
        for name, s in scenarios.items()
    ]
    for name in READY_MADE:
        motion = preset(name).motion()
        out.append(Known(f"the built-in {name}", motion, 0.0, float(motion.times[-1]), limits))
    return out


def fastest_swing(limits: Limits, frame_rate: float) -> float:
    """Highest frequency [Hz]: still of some size at the greatest acceleration, and seen by four frames a period."""
    shaken = float(np.sqrt(limits.acceleration / _LEAST_AMPLITUDE)) / (2 * np.pi)
    return max(min(shaken, frame_rate / 4, limits.rate / 10), 1.0 / limits.duration)


def _or_none(unit: FloatArray) -> FloatArray:
    """From -1 to 1, and zero for the middle third: motions along few axes are as likely as those along all."""
    x = 3.0 * (2.0 * unit - 1.0)
    return np.asarray(np.sign(x) * np.clip(np.abs(x) - 1.0, 0.0, None) / 2.0)


def _minimum_jerk(share: FloatArray) -> FloatArray:
    """From 0 to 1 with minimal jerk (Flash and Hogan 1985)."""
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s**3 * (10 - 15 * s + 6 * s**2))


def _eased(times: FloatArray, values: FloatArray) -> FloatArray:
    """``values (K, G, 3)`` blended from zero and into the last one within :data:`_EASE`, and so at rest there.

    A speed that is there at once is no rest, and the finer the samples are, the greater an acceleration it is. What
    lies on one side of zero stays there, so a workspace that is closed on a side is kept.
    """
    begin, end = (_minimum_jerk(t / _EASE)[:, None, None] for t in (times - times[0], times[-1] - times))
    return np.asarray(begin * (end * values + (1.0 - end) * values[-1:]))


def _bump(share: FloatArray) -> FloatArray:
    """From 0 up to 1 in the first quarter and back in the last one."""
    return _minimum_jerk(4 * share) * _minimum_jerk(4 * (1 - share))


def _quaternions(vectors: FloatArray) -> FloatArray:
    """Unit quaternions w x y z ``(..., 4)`` of rotation vectors ``(..., 3)`` [rad]."""
    flat = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat()
    return np.asarray(np.roll(flat, 1, axis=-1).reshape(*vectors.shape[:-1], 4))


def _along(vector: FloatArray) -> str:
    """The axes along which a vector has at least a third of its largest component."""
    large = np.abs(vector) > np.abs(vector).max() / 3
    return " and ".join(a for a, is_large in zip("xyz", large, strict=True) if is_large)
