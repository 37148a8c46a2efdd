"""A made-up linear model of a small cloth, fitted exactly: what a test of adequacy can be held against."""

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.body import cloth_grid
from muslin.core.measurement import Recording
from muslin.core.motion import Motion
from muslin.core.rollout import Trajectory
from muslin.core.scenario import Scenario
from muslin.core.series import PointSeries
from muslin.inference.criticism.comparing.held import Held, as_recorded
from muslin.inference.noise import Noise
from muslin.inference.residuals import Offsets, residual

SIDE, FRAMES, PARAMETERS, SD = 4, 24, 3, 0.002
TIME = np.arange(FRAMES) / 30
BODY = cloth_grid(0.3, 0.3, SIDE, SIDE)


def scenario() -> Scenario:
    motion = Motion.from_positions(np.zeros(1), np.zeros((1, 1, 3)))
    markers, none = np.eye(SIDE * SIDE), np.zeros(0, np.int64)
    return Scenario("linear", BODY, (np.array([0, SIDE - 1]),), motion, TIME, markers, none)


def swinging() -> FloatArray:
    """Vertices ``(T, V, 3)`` [m] of a sheet that turns about its top edge, then stands still."""
    angle = 0.6 * np.sin(2 * np.pi * np.minimum(TIME, 0.5))[:, None]
    x, z = BODY.vertices[:, 0], BODY.vertices[:, 2]
    return np.stack([x + 0 * angle, -z * np.sin(angle), z * np.cos(angle)], axis=-1)


def sensitivity() -> FloatArray:
    """Of the points by the parameters in the unit cube ``(D, T, V, 3)`` [m]."""
    rng = np.random.default_rng(3)
    phase = rng.uniform(0, 6, (PARAMETERS, 1, SIDE * SIDE, 3))
    return 0.05 * np.sin(2 * np.pi * 1.5 * TIME[:, None, None] + phase) * BODY.vertices[:, 2:] / 0.3


def fitted(
    points: FloatArray, noise: Noise, offsets: Offsets, truth: FloatArray
) -> tuple[list[Held], FloatArray, FloatArray]:
    """The linear model fitted to measured ``points (T, V, 3)``: takes, Jacobian of white residuals, unit parameters.

    Nothing bounds the fit but the unit cube, far away if ``truth`` is in its middle.
    """
    recording, base, slope = Recording("made up", PointSeries(TIME, points)), swinging(), sensitivity()

    def predicted(unit: FloatArray) -> PointSeries:
        return PointSeries(TIME, base + np.tensordot(unit - truth, slope, 1))

    def white(unit: FloatArray) -> FloatArray:
        return residual(recording, predicted(unit), noise, offsets).white

    start = white(truth)
    jacobian = np.stack([white(truth + e) - start for e in np.eye(PARAMETERS)], axis=1)
    unit = truth - np.linalg.lstsq(jacobian, start, rcond=None)[0]
    best = Trajectory(predicted(unit), base, np.zeros((FRAMES, 1, 7)))
    off = residual(recording, best.series, noise, offsets)
    held = Held(recording, scenario(), True, best, as_recorded(best, off), off, np.zeros((0, *base.shape)))
    return [held], jacobian, unit


def measured(rng: np.random.Generator, ar1: float = 0.0) -> FloatArray:
    """The truth under AR(1) noise."""
    noise = rng.normal(size=(FRAMES, SIDE * SIDE, 3))
    for t in range(1, FRAMES):
        noise[t] = ar1 * noise[t - 1] + np.sqrt(1 - ar1**2) * noise[t]
    return swinging() + SD * noise
