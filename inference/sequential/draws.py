"""Simulated draws on disk: one chunk a draw, whole or absent, so that a killed fit goes on."""

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
import zarr

from ...core.arrays import BoolArray, FloatArray, IntArray
from ...core.errors import StoreError
from ...core.rollout import Trajectory
from ...core.store import damage_errors, empty_draws, put, storage_errors
from ...core.study import Outcome, Problem, Study

ABSENT, WHOLE, FAILED = 0, 1, 2


class DrawStore:
    """The draws of one fit, in the order in which they were proposed.

    The status of a draw is written last: a draw whose status is absent does not exist, whatever else
    of it reached the disk.

    Args:
        study: whose results store is used.
        problem: what is simulated.
        recordings: for which a rollout is simulated.
        count: draws in all rounds together.
    """

    def __init__(self, study: Study, problem: Problem, recordings: Sequence[str], count: int) -> None:
        self._path = study.results_path
        self.recordings = list(recordings)
        made_with = {"fingerprint": study.fingerprint(), "engine": problem.simulator.engine_version()}
        root = study.results("r+")
        with damage_errors(self._path):
            found = root.get("fit")
        if isinstance(found, zarr.Group) and any(found.attrs.get(k) not in (None, v) for k, v in made_with.items()):
            study.progress(f"the study has changed; its earlier results are kept in {study.set_aside()}", 0, 0)
            found = None
        fit = found if isinstance(found, zarr.Group) and "fingerprint" in found.attrs else None
        if fit is None:
            with storage_errors(self._path):
                fit = self._create(study.results("r+"), problem, self.recordings, count, made_with)
        self.group: zarr.Group = fit
        with damage_errors(self._path):
            self._draws: dict[str, Any] = {name: fit[f"draws/{name}"] for name in ("theta", "status")}
            self._points: dict[str, Any] = {r: fit[f"draws/{_array(r)}"] for r in self.recordings}
            self.status = np.asarray(self._draws["status"][...])

    @staticmethod
    def _create(
        root: zarr.Group, problem: Problem, recordings: Sequence[str], count: int, made_with: dict[str, Any]
    ) -> zarr.Group:
        fit = root.create_group("fit", overwrite=True)
        draws = fit.create_group("draws")
        draws.attrs["parameters"] = list(problem.space.names)
        empty_draws(draws, "theta", (count, len(problem.space)), ["draw", "parameter"], "unit cube", "float64", np.nan)
        for name in recordings:
            series = problem.recordings[name].series
            points = problem.points_of(name)
            put(draws, f"time_{name}", series.time, [f"time_{name}"], "s")
            shape = (count, series.frames, points, series.points.shape[2])
            dims = ["draw", f"time_{name}", "point", "axis"]
            empty_draws(draws, _array(name), shape, dims, series.unit, "float32", np.nan)
        empty_draws(draws, "status", (count,), ["draw"], "1", "int8", ABSENT)
        fit.attrs["failures"] = {}
        fit.attrs.update(made_with)  # last: a store without it is made anew
        return fit

    def write(self, draw: int, theta: FloatArray, outcomes: Mapping[str, Outcome]) -> None:
        """Write one draw: all its recordings, or the reason why one of them failed."""
        with storage_errors(self._path):
            self._draws["theta"][draw] = theta
            reasons = [o.reason for o in outcomes.values() if not isinstance(o, Trajectory)]
            if reasons:
                self.group.attrs["failures"] = {**self._failures(), str(draw): reasons[0]}
            else:
                for name, outcome in outcomes.items():
                    assert isinstance(outcome, Trajectory)
                    self._points[name][draw] = outcome.series.points.astype(np.float32)
            self._draws["status"][draw] = FAILED if reasons else WHOLE
        self.status[draw] = FAILED if reasons else WHOLE

    def _failures(self) -> dict[str, str]:
        stored = cast(Mapping[str, str], self.group.attrs.get("failures", {}))
        return dict(stored)

    def failures(self) -> list[str]:
        """Reasons of the draws that failed."""
        return list(self._failures().values())

    def forget_failures(self) -> None:
        """Make failed draws absent again, so that they are tried anew when the fit goes on."""
        failed = self.status == FAILED
        self.status = np.where(failed, np.int8(ABSENT), self.status)
        with storage_errors(self._path):
            self._draws["status"][...] = self.status
            self.group.attrs["failures"] = {}

    def tried(self, upto: int) -> tuple[FloatArray, BoolArray]:
        """Unit parameters ``(N, D)`` of the first ``upto`` draws that exist, and which of them failed ``(N,)``."""
        there = self.status[:upto] != ABSENT
        with damage_errors(self._path):
            theta = np.asarray(self._draws["theta"][:upto])[there]
        return theta, self.status[:upto][there] == FAILED

    def read(self, upto: int) -> tuple[FloatArray, list[FloatArray], IntArray]:
        """Whole draws among the first ``upto``: unit parameters, points a recording, and their numbers."""
        if (self.status[:upto] == ABSENT).any():
            raise StoreError(f"{self._path}: a draw of an earlier round is missing")
        whole = np.flatnonzero(self.status[:upto] == WHOLE)
        with damage_errors(self._path):
            theta = np.asarray(self._draws["theta"][:upto])[whole]
            points = [np.asarray(self._points[r][:upto], dtype=np.float64)[whole] for r in self.recordings]
        if not np.isfinite(theta).all() or not all(np.isfinite(p).all() for p in points):
            raise StoreError(f"{self._path}: draws that were there are gone; move it away and run the fit again")
        return theta, points, whole


def _array(recording: str) -> str:
    return f"points_{recording}"
