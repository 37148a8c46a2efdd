"""Sizes of the measurement of perception."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Sizes of the measurement.

    Args:
        scenarios: built-in ones.
        shifts: those of them that are also rendered from the other engine, and measured across.
        frames, draws: that are learned from, and of how many draws of the prior they are.
        held_out, held_out_draws: the same that are measured on, of other draws.
        epochs: of training ``heatmap`` at most.
        keypoints: of ``transporter``.
        steps: of its training.
        focused, focus: scenarios in which it is also trained with its option ``focus``, and that value.
        seed: of draws, looks, cameras and weights; held-out draws have this plus 1000.
    """

    scenarios: tuple[str, ...] = ("wiping", "fling", "winding")
    shifts: tuple[str, ...] = ("fling",)
    frames: int = 240
    draws: int = 8
    held_out: int = 60
    held_out_draws: int = 4
    epochs: int = 20
    keypoints: tuple[int, ...] = (4, 8)
    steps: int = 600
    focused: tuple[str, ...] = ("winding",)
    focus: float = 3.0
    seed: int = 0
