"""Built-in scenarios: cloth held at two corners under several motions, and the clamped beam."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from .arrays import FloatArray, IntArray
from .body import Body, cloth_grid, solid_box
from .errors import InputError
from .motion import Motion
from .obstacles import Obstacle
from .registry import nearest

RATE = 100.0  # of built-in commands [Hz]


@dataclass(frozen=True, eq=False)
class Preset:
    """What a scenario name stands for; every field can be overridden in a study.

    Args:
        kind: of body.
        size: cloth: width, height; solid: x, y, z [m].
        vertices: counts along the same axes (cloth: columns, rows).
        origin: low corner of a solid [m].
        motion: built-in command, used where a recording has none.
        grasps: of the body, vertices a gripper.
        load_vertices: where loads hang.
        settle: [s].
        obstacles: what stands around it.
    """

    kind: str
    size: tuple[float, ...]
    vertices: tuple[int, ...]
    motion: Callable[[], Motion]
    grasps: Callable[[Body], tuple[IntArray, ...]]
    load_vertices: Callable[[Body], IntArray] = field(default=lambda body: np.zeros(0, np.int64))
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    settle: float = 0.0
    obstacles: tuple[Obstacle, ...] = ()

    def body(self, size: Sequence[float] | None = None, vertices: Sequence[int] | None = None) -> Body:
        size, counts = tuple(size or self.size), tuple(vertices or self.vertices)
        wanted = 2 if self.kind == "cloth" else 3
        if len(size) != wanted or len(counts) != wanted or min(size) <= 0:
            raise InputError(
                f"[scenario]: a {self.kind} needs {wanted} positive sizes [m] and {wanted} vertex counts, "
                f"got size = {list(size)} and vertices = {list(counts)}"
            )
        if self.kind == "cloth":
            return cloth_grid(size[0], size[1], counts[0], counts[1])
        low = np.array(self.origin)
        return solid_box(low, low + np.array(size), (counts[0], counts[1], counts[2]))


def top_corners(body: Body) -> tuple[IntArray, ...]:
    """One gripper that holds the two top corners, as a bar would."""
    assert body.grid is not None
    return (np.array([0, body.grid[1] - 1]),)


def low_y_face(body: Body) -> tuple[IntArray, ...]:
    """A clamp around the face of smallest y."""
    return (np.flatnonzero(body.vertices[:, 1] < body.vertices[:, 1].min() + 1e-9),)


def high_y_face(body: Body) -> IntArray:
    """The face of largest y."""
    return np.flatnonzero(body.vertices[:, 1] > body.vertices[:, 1].max() - 1e-9)


def nothing_held(body: Body) -> tuple[IntArray, ...]:
    """A body that nobody holds."""
    return ()


def smooth_path(knots: Sequence[tuple[float, float, float, float]], tail: float = 0.0) -> Motion:
    """A gripper through ``(time, x, y, z)`` knots, at rest in each (minimum-jerk between them)."""
    k = np.array(knots, float)
    times = np.arange(0.0, k[-1, 0] + tail + 0.5 / RATE, 1.0 / RATE)
    right = np.clip(np.searchsorted(k[:, 0], times, side="right"), 1, len(k) - 1)
    s = np.clip((times - k[right - 1, 0]) / (k[right, 0] - k[right - 1, 0]), 0, 1)[:, None]
    blend = s**3 * (10 - 15 * s + 6 * s**2)
    return Motion.from_positions(times, (k[right - 1, 1:] + blend * (k[right, 1:] - k[right - 1, 1:]))[:, None])


def swing_motion(
    amplitude: float = 0.10, frequency: float = 0.9, cycles: float = 2.0, along: Sequence[float] = (0.3, 1.0, 0.0)
) -> Motion:
    """To and fro along a horizontal direction, growing from rest over the first half cycle."""
    duration = cycles / frequency
    times = np.arange(0.0, duration + 0.5 / RATE, 1.0 / RATE)
    direction = np.asarray(along, float) / np.linalg.norm(along)
    grow = np.clip(times * frequency * 2.0, 0, 1)
    wave = amplitude * grow**2 * (3 - 2 * grow) * np.sin(2 * np.pi * frequency * times)
    positions: FloatArray = wave[:, None] * direction + np.array([0.0, 0.0, 1.0])
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


PRESETS: dict[str, Preset] = {
    "fling": Preset("cloth", (0.3, 0.3), (9, 9), fling_motion, top_corners, settle=0.5),
    "swing": Preset("cloth", (0.3, 0.3), (9, 9), swing_motion, top_corners, settle=0.5),
    "lift": Preset("cloth", (0.3, 0.3), (9, 9), lift_motion, top_corners, settle=0.5),
    "hang": Preset("cloth", (0.3, 0.3), (9, 9), still_motion, top_corners, settle=0.0),
    "drop": Preset("cloth", (0.3, 0.3), (9, 9), still_motion, nothing_held),
    # The silicone beam of Dubied et al. (2022), in the frame of its motion capture turned z up: the
    # cross-section and the tip face placed from the marker coordinates that its authors publish.
    "beam": Preset(
        "solid",
        (0.03, 0.10, 0.03),
        (3, 7, 3),
        Motion.still,
        low_y_face,
        high_y_face,
        origin=(0.0153, -0.0264, 0.0386),
    ),
}


def preset(name: str) -> Preset:
    """A built-in scenario by name."""
    if name not in PRESETS:
        raise InputError(f"there is no scenario {name!r}.{nearest(name, list(PRESETS))} Built in: {', '.join(PRESETS)}")
    return PRESETS[name]
