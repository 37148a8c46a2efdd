"""A sheet whose motion is known, as the reader of carried cloths is given it."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from muslin.core.motion import rotate


def carried(
    lag: float, offset: Sequence[float], n: int = 5, lean: float = 0.0, work: np.ndarray[Any, Any] | None = None
) -> dict[str, Any]:
    """A rigid sheet under a hand that moves and tilts, seen late and aside by a camera. It leans about y.

    With ``work`` [s], of so many frames, each is stamped as it is done, and the next one seen then.
    """
    clock, seen = np.arange(0, 6, 0.05), np.arange(0.5, 5.5, 0.1)
    if work is not None:
        seen = 0.5 + np.concatenate([[0.0], np.cumsum(work)[:-1]])

    def hand(t: np.ndarray[Any, Any]) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
        at = np.stack([0.1 * np.sin(1.3 * t), -0.4 + 0.08 * np.sin(2.1 * t), 0.35 + 0.05 * np.cos(1.7 * t)], axis=1)
        a = 0.15 * np.sin(1.1 * t)  # about x, before the home orientation
        return at, np.stack([np.cos(a), np.sin(a), 0 * a, 0 * a], axis=1)

    def times_home(q: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        w, x = q[:, 0], q[:, 1]
        s = 0.5**0.5  # (w, x, 0, 0) * (0, s, s, 0)
        return np.stack([-x * s, w * s, w * s, x * s], axis=1)

    at, turn = hand(clock)
    home = times_home(turn)
    then, its_turn = hand(seen - lag)
    grid = np.stack(np.meshgrid(np.linspace(-0.15, 0.15, n), np.linspace(-0.3, 0.0, n), indexing="ij"), axis=-1)
    local = np.stack([grid[..., 0], 0 * grid[..., 0], grid[..., 1] - 0.1], axis=-1).reshape(-1, 3)
    local = rotate(np.array([np.cos(lean / 2), 0.0, np.sin(lean / 2), 0.0]), local)
    mesh = rotate(its_turn[:, None], np.broadcast_to(local, (len(seen), *local.shape))) + then[:, None]
    mesh = (mesh + np.array(offset)).reshape(len(seen), n, n, 3)
    seen = seen if work is None else seen + work
    return {"mesh": mesh, "t": seen, "tcp_t": clock, "tcp": np.concatenate([at, home[:, [1, 2, 3, 0]]], axis=1)}
