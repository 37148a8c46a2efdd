"""What a comparison of simulators found."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..parameters import ParameterSpace

#: Stands for what cannot be told.
UNKNOWN = "\u2013"


@dataclass(frozen=True, eq=False)
class SimulatorRun:
    """All draws on one simulator.

    Args:
        name: of the simulator.
        engine: its engine's name and version.
        vertices: ``(D, T, V, 3)`` [m], NaN where a draw failed.
        failures: the reason by number of the draw.
        seconds: of computation of every draw ``(D,)`` [s], NaN where it failed.
    """

    name: str
    engine: str
    vertices: FloatArray
    failures: dict[int, str]
    seconds: FloatArray

    @cached_property
    def whole(self) -> BoolArray:
        """Which draws ended well ``(D,)``."""
        return np.asarray(np.isfinite(self.vertices).all(axis=(1, 2, 3)))

    def sensitivity(self, unit_draws: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What every parameter does, by least squares on all parameters at once.

        Args:
            unit_draws: ``(D, P)`` parameters in the unit cube.

        Returns:
            How far a vertex moves when the parameter crosses its whole prior, root mean square over vertices
            and time ``(P,)`` [m], and those displacements ``(P, T, V, 3)`` [m]. NaN with too few whole draws.
        """
        count, parameters = int(self.whole.sum()), unit_draws.shape[1]
        if count <= parameters + 1:
            nothing = np.full((parameters, *self.vertices.shape[1:]), np.nan)
            return np.full(parameters, np.nan), nothing
        design = np.column_stack([np.ones(count), unit_draws[self.whole] - 0.5])
        flat = self.vertices[self.whole].reshape(count, -1)
        slopes = np.linalg.lstsq(design, flat, rcond=None)[0][1:].reshape(parameters, *self.vertices.shape[1:])
        return np.asarray(np.sqrt(np.mean(np.sum(slopes**2, axis=-1), axis=(1, 2)))), np.asarray(slopes)


@dataclass(frozen=True, eq=False)
class SimulatorComparison:
    """The same draws on several simulators.

    Args:
        scenario: its name.
        kind: of the object.
        space: what was drawn.
        unit_draws: ``(D, P)`` in the unit cube of the space.
        times: observation times ``(T,)`` [s].
        runs: one a simulator.
    """

    scenario: str
    kind: str
    space: ParameterSpace
    unit_draws: FloatArray
    times: FloatArray
    runs: tuple[SimulatorRun, ...]

    @property
    def pairs(self) -> list[tuple[SimulatorRun, SimulatorRun]]:
        """Every two simulators."""
        return list(combinations(self.runs, 2))

    def difference(self, one: SimulatorRun, other: SimulatorRun) -> FloatArray:
        """Root mean square distance between the vertices of both ``(D, T)`` [m]; NaN where one of them failed."""
        return np.asarray(np.sqrt(np.mean(np.sum((one.vertices - other.vertices) ** 2, axis=-1), axis=-1)))

    def spread(self, run: SimulatorRun) -> float:
        """How far the draws of one simulator lie from their mean, root mean square over all [m]."""
        if run.whole.sum() < 2:
            return float("nan")
        kept = run.vertices[run.whole]
        return float(np.sqrt(np.mean(np.sum((kept - kept.mean(axis=0)) ** 2, axis=-1))))

    def by_region(self, one: SimulatorRun, other: SimulatorRun) -> FloatArray:
        """Median difference [m] in the lower, middle and upper third of every parameter ``(P, 3)``."""
        size = np.sqrt(np.mean(self.difference(one, other) ** 2, axis=1))
        third = np.minimum((self.unit_draws * 3).astype(int), 2)
        table = np.full((len(self.space), 3), np.nan)
        for p in range(len(self.space)):
            for k in range(3):
                here = size[(third[:, p] == k) & np.isfinite(size)]
                table[p, k] = np.median(here) if len(here) else np.nan
        return table

    def alike(self, one: SimulatorRun, other: SimulatorRun) -> FloatArray:
        """Cosine ``(P,)`` between what each parameter does on both: 1 if it moves every vertex the same way."""
        a, b = one.sensitivity(self.unit_draws)[1], other.sensitivity(self.unit_draws)[1]
        a, b = a.reshape(len(a), -1), b.reshape(len(b), -1)
        size = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
        return np.asarray(np.sum(a * b, axis=1) / np.where(size > 0, size, np.nan))

    def to_json(self) -> dict[str, Any]:
        """Everything but the trajectories, for scripts."""
        names = list(self.space.names)
        return {
            "scenario": self.scenario,
            "draws": len(self.unit_draws),
            "parameters": names,
            "simulators": {
                r.name: {
                    "engine": r.engine,
                    "failed": len(r.failures),
                    "reasons": sorted(set(r.failures.values())),
                    "seconds_per_rollout": _median(r.seconds),
                    "spread_m": self.spread(r),
                    "sensitivity_m": dict(zip(names, r.sensitivity(self.unit_draws)[0].tolist(), strict=True)),
                }
                for r in self.runs
            },
            "pairs": [
                {
                    "simulators": [a.name, b.name],
                    "median_difference_m": _median(np.sqrt(np.mean(self.difference(a, b) ** 2, axis=1))),
                    "by_thirds_m": dict(zip(names, self.by_region(a, b).tolist(), strict=True)),
                    "cosine_of_sensitivities": dict(zip(names, self.alike(a, b).tolist(), strict=True)),
                }
                for a, b in self.pairs
            ],
        }

    @property
    def too_few(self) -> str:
        """What to say where sensitivities cannot be told for want of draws; otherwise nothing."""
        if all(np.isfinite(r.sensitivity(self.unit_draws)[0]).all() for r in self.runs):
            return ""
        return f"too few draws ended well to tell; {4 * (len(self.space) + 1)} or more would do"

    def text(self) -> str:
        """The result in lines for a terminal."""
        lines = [f"{self.scenario}: {len(self.unit_draws)} draws of {', '.join(self.space.names)}", ""]
        for r in self.runs:
            failed = f"{len(r.failures)} failed" if r.failures else "none failed"
            lines.append(f"  {r.name:10s} {told(_median(r.seconds), 2)} s a rollout, {failed} ({r.engine})")
            lines += [f"             failed: {reason}" for reason in sorted(set(r.failures.values()))[:3]]
        lines += ["", "how far a vertex moves when the parameter crosses its prior [mm]"]
        lines.append("  " + " " * 20 + "".join(f"{r.name:>12s}" for r in self.runs))
        moves = [r.sensitivity(self.unit_draws)[0] for r in self.runs]
        for p, name in enumerate(self.space.names):
            lines.append(f"  {name:20s}" + "".join(f"{told(1000 * m[p]):>12s}" for m in moves))
        for a, b in self.pairs:
            size = _median(np.sqrt(np.mean(self.difference(a, b) ** 2, axis=1)))
            spread = f"{told(1000 * self.spread(a))} and {told(1000 * self.spread(b))}"
            lines += [
                "",
                f"{a.name} and {b.name} are {told(1000 * size)} mm apart (median draw, RMS over vertices, time); "
                f"draws spread by {spread} mm",
            ]
            regions, cosines = self.by_region(a, b), self.alike(a, b)
            for p, name in enumerate(self.space.names):
                low, middle, high = (told(1000 * x) for x in regions[p])
                lines.append(
                    f"  {name:20s} low {low}, middle {middle}, high {high} mm apart; "
                    f"what it does has cosine {told(cosines[p], 2)}"
                )
        if self.too_few:
            lines += ["", f"{UNKNOWN}: {self.too_few}"]
        return "\n".join(lines)


def told(value: float, digits: int = 1) -> str:
    """A number for people."""
    return f"{value:.{digits}f}" if np.isfinite(value) else UNKNOWN


def _median(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else float("nan")
