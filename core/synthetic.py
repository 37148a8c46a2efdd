"""Measurements with a hidden effect: known truth to practise and to test on."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from .arrays import FloatArray
from .effect import Effect
from .errors import InputError
from .material import DEFAULT_PRIORS, ClothMaterial, with_fields
from .measurement import Measurement, Recording
from .motion import Motion
from .registry import REGISTRY
from .rollout import rollout
from .scenario import Scenario, marker_weights
from .scenarios import fling_motion, preset, swing_motion
from .simulator import Simulator

#: Vertices of the 9 x 9 cloth that carry a marker: every second one of every second row.
MARKERS = [r * 9 + c for r in range(0, 9, 2) for c in range(0, 9, 2)]
#: Motions; the last is held out: a fling higher, wider and slower than the one that is fitted.
MOTIONS: dict[str, Callable[[], Motion]] = {
    "fling": fling_motion,
    "swing": swing_motion,
    "fling-wide": lambda: fling_motion(reach=0.30, height=0.10, duration=0.65),
}
HELD_OUT = "fling-wide"
CAMERA_RATE = 30.0  # [Hz]

#: What is drawn for a hidden effect: magnitude of every coefficient [its unit], as measured on real
#: cloth, robots and rooms; the sign is drawn too where the prior has two.
STRENGTHS: dict[str, dict[str, tuple[float, float]]] = {
    "air-drag": {"drag_coefficient": (0.8, 1.4), "lift_coefficient": (0.0, 0.5)},
    "wind": {"velocity_x": (0.2, 0.7), "velocity_y": (0.2, 0.7)},
    "viscous-damping": {"rate": (0.5, 2.5)},
    "internal-damping": {"damping_time": (0.005, 0.02)},
    "gravity-tilt": {"about_x": (0.01, 0.035), "about_y": (0.01, 0.035)},
    "actuator-lag": {"time_constant": (0.02, 0.06)},
    # of a square plate 0.58 of a long one's (DNV-RP-C205, table A-2), less where cloth lets air through
    "added-mass": {"fraction": (0.35, 0.6)},
    # two extra layers 15 to 40 mm wide of 0.15 kg/m2, with seam or cord
    "hem": {"line_mass": (0.005, 0.012)},
    # textiles hold half to one and a half times their own mass of water
    "wet-patch": {"uptake": (0.5, 1.5), "extent": (0.2, 0.5)},
    # exposure, transfer and a network: one to two frames at 30 Hz
    "camera-latency": {"latency": (0.02, 0.06)},
    # what a calibration with a hand-held board leaves: some millimetres, some tenths of a degree
    "camera-offset": {"x": (0.003, 0.01), "y": (0.003, 0.01), "z": (0.003, 0.01)},
    "camera-rotation": {"about_x": (0.003, 0.01), "about_y": (0.003, 0.01), "about_z": (0.003, 0.01)},
}
#: The effects among which the recorded example and its benchmark draw, in this order.
FIRST_EFFECTS = ("actuator-lag", "air-drag", "gravity-tilt", "internal-damping", "viscous-damping", "wind")


def hidden_effect(
    effect: str | None, seed: int, *, simulator: Simulator | None = None, noise: float = 0.003
) -> tuple[Measurement, dict[str, Any]]:
    """A generated measurement of a 0.3 m cloth, and what it hides.

    Args:
        effect: name of the hidden effect, or None for no effect at all.
        seed: of parameters, coefficients and noise.
        simulator: that plays reality; default MuJoCo.
        noise: standard deviation of every coordinate of every marker [m].

    Returns:
        The measurement, and the hidden truth for the reader of a report.
    """
    rng = np.random.default_rng([seed, 20])
    simulator = simulator or REGISTRY.get("simulator", "mujoco")()
    material = ClothMaterial()
    # the middle of the prior in the logarithm, so that a posterior has room on both sides
    drawn = {p.name: float(p.low * (p.high / p.low) ** rng.uniform(0.25, 0.75)) for p in DEFAULT_PRIORS["cloth"]}
    material = with_fields(material, drawn)
    active: list[Effect] = []
    coefficients: dict[str, float] = {}
    if effect is not None:
        if effect not in STRENGTHS:
            raise InputError(f"no strength is known for effect {effect!r}; known: {', '.join(STRENGTHS)}")
        cls: type[Effect] = REGISTRY.get("effect", effect)
        two_sided = {c.name: c.low < 0 for c in cls.coefficients}
        for name, (low, high) in STRENGTHS[effect].items():
            sign = rng.choice([-1.0, 1.0]) if two_sided[name] else 1.0
            coefficients[name] = float(sign * rng.uniform(low, high))
        active = [cls(**coefficients)]
    recordings = []
    for name, make in MOTIONS.items():
        motion = make()
        times = np.arange(0.0, motion.times[-1] + 1e-9, 1.0 / CAMERA_RATE)
        series = rollout(simulator, _scenario(motion, times), material, active).series
        noisy: FloatArray = series.points + rng.normal(0.0, noise, series.points.shape)
        recordings.append(Recording(name, replace(series, points=noisy), motion))
    hidden = {"effect": effect, "coefficients": coefficients, "material": drawn, "noise_m": noise, "seed": seed}
    return Measurement(tuple(recordings)), hidden


def _scenario(motion: Motion, times: FloatArray) -> Scenario:
    base = preset("fling")
    body = base.body()
    return Scenario(
        name="hidden",
        body=body,
        grasps=base.grasps(body),
        motion=motion,
        times=times,
        markers=marker_weights(len(body.vertices), np.array(MARKERS)),
        load_vertices=base.load_vertices(body),
        settle=base.settle,
    )


__all__ = ["CAMERA_RATE", "FIRST_EFFECTS", "HELD_OUT", "MARKERS", "MOTIONS", "STRENGTHS", "hidden_effect"]
