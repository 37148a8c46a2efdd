"""One recording held against the best prediction of it, and the numbers that are compared."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ....core.arrays import BoolArray, FloatArray, IntArray
from ....core.measurement import Recording
from ....core.rollout import Trajectory
from ....core.scenario import Scenario
from ...residuals import Residual
from .surface import surface_lattice


def as_recorded(predicted: Trajectory, off: Residual) -> Trajectory:
    """``predicted`` when and where the recording would show it, by the offsets that were taken out of ``off``.

    The mesh stays where it is if the offset is one of pixels.
    """
    time, series = predicted.series.time, predicted.series
    vertices = (off.recorded if series.unit == "m" else off.late)(time, predicted.vertices)
    return replace(predicted, series=replace(series, points=off.recorded(time, series.points)), vertices=vertices)


@dataclass(frozen=True, eq=False)
class Held:
    """A recording of T frames with P measured points, and its best prediction of Q points.

    Args:
        recording, scenario: what was measured, and how.
        fitted: the parameters were fitted on it.
        best: the prediction.
        shown: the same when and where the recording would show it; see :func:`as_recorded`.
        residual: measured minus predicted, offsets taken out.
        draws: predictions of posterior draws, when and where the recording would show them ``(K, T, Q, A)`` [unit].
        marked: the predicted points are the markers of the scenario, and were not found in pictures.
        baseline: measured minus the first measured shape, carried along by the gripper ``(T, P, A)`` [unit].
        unfitted: measured minus what the unfitted model predicts, in the same way; NaN if it cannot be simulated.
    """

    recording: Recording
    scenario: Scenario
    fitted: bool
    best: Trajectory
    shown: Trajectory
    residual: Residual
    draws: FloatArray
    marked: bool = True
    baseline: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 0)))
    unfitted: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 0)))

    @property
    def name(self) -> str:
        return self.recording.name

    @property
    def paired(self) -> bool:
        """Point p of the measurement is point p of the prediction."""
        return self.recording.series.correspondence

    @cached_property
    def seen(self) -> BoolArray:
        """Which numbers were measured ``(T, P, A)``; as in :attr:`Residual.white`, in this order."""
        return np.asarray(np.isfinite(self.residual.difference))

    @cached_property
    def partner(self) -> IntArray:
        """The predicted point that each measured one is held against ``(T, P)``; 0 where none was seen."""
        measured, model = self.recording.series.points, self.shown.series.points
        if self.paired:
            return np.tile(np.arange(measured.shape[1]), (len(measured), 1))
        out = np.zeros(measured.shape[:2], np.int64)
        for t, seen in enumerate(self.recording.series.valid):
            if seen.any():
                out[t, seen] = cKDTree(model[t]).query(measured[t, seen])[1]
        return out

    @cached_property
    def vertex(self) -> IntArray:
        """The vertex that each predicted point lies on, or nearest to ``(T, Q)``: in the rest shape if it is a marker,
        else in every frame, as the camera sees it where points are pixels.
        """
        model, body = self.shown.series.points, self.scenario.body
        if self.marked:
            near = cKDTree(body.vertices).query(self.scenario.markers @ body.vertices)[1]
            return np.tile(near, (len(model), 1))
        return np.stack([_nearest(v, p) for v, p in zip(self.shapes, model, strict=True)])

    @cached_property
    def shapes(self) -> FloatArray:
        """The predicted vertices ``(T, V, A)``, as the camera sees them where points are pixels."""
        if self.shown.series.unit == "m":
            return self.shown.vertices
        assert self.scenario.camera is not None
        return self.scenario.camera.project(self.shown.vertices)[0]

    @property
    def usual_vertex(self) -> IntArray:
        """The vertex that each predicted point lies on most often ``(Q,)``."""
        return np.array([np.bincount(v).argmax() for v in self.vertex.T])

    def of_partner(self, by_vertex: IntArray) -> IntArray:
        """What belongs to a vertex ``(V,)``, or to it at each time ``(T, V)``, of each measured point's ``(T, P)``."""
        at = by_vertex[self.vertex] if by_vertex.ndim == 1 else np.take_along_axis(by_vertex, self.vertex, axis=1)
        return np.asarray(np.take_along_axis(at, self.partner, axis=1))

    @cached_property
    def origin(self) -> FloatArray:
        """Where each measured point came from if the prediction is right ``(T, P, A)`` [unit].

        With correspondence the predicted point. Without, of named markers the predicted ones that lie nearest as a
        whole, none taken twice; of points anywhere on the object the nearest place on its predicted surface.
        """
        measured, model = self.recording.series.points, self.shown.series.points
        if self.paired:
            return model
        out = np.full(measured.shape, np.nan)
        lattice = surface_lattice(self.scenario) if self.marked else None
        for t, seen in enumerate(self.recording.series.valid):
            if not seen.any():
                continue
            if lattice is not None:
                places = lattice @ self.shapes[t]
                out[t, seen] = places[cKDTree(places).query(measured[t, seen])[1]]
            elif seen.sum() <= model.shape[1]:
                gaps = ((measured[t, seen][:, None] - model[t][None]) ** 2).sum(axis=2)
                out[t, seen] = model[t, linear_sum_assignment(gaps)[1]]
            else:
                out[t, seen] = model[t, self.partner[t, seen]]
        return out

    def under_noise(self, noise: FloatArray) -> FloatArray:
        """What would be measured minus predicted had the best prediction been measured with this noise.

        Args:
            noise: ``(R, T, P, A)`` [unit].

        Returns:
            ``(R, T, P, A)`` [unit]. Points without correspondence look for their nearest one anew, which makes the
            difference smaller than the noise.
        """
        if self.paired:
            return noise
        out = np.zeros_like(noise)
        model, origin = self.shown.series.points, self.origin
        for t, seen in enumerate(self.recording.series.valid):
            if seen.any():
                made = origin[t, seen] + noise[:, t, seen]
                out[:, t, seen] = made - model[t, cKDTree(model[t]).query(made)[1]]
        return out


def _nearest(vertices: FloatArray, points: FloatArray) -> IntArray:
    """Of ``vertices (V, A)`` the nearest to each of ``points (Q, A)``; NaN are those behind the camera."""
    there = np.flatnonzero(np.isfinite(vertices).all(axis=1))
    return np.asarray(there[cKDTree(vertices[there]).query(points)[1]])
