"""What every simple term would do to the residuals, were it the force that has been estimated."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ....core.arrays import FloatArray
from ....core.effect import Effect
from ....core.material import with_fields
from ....core.scenario import STANDARD_GRAVITY
from ....core.scene import Scene
from ....core.simulator import State
from ....core.study import Problem
from .estimate import Estimate, ForceObjective, Unknowns
from .follow import velocities_of

#: Frequencies at which an oscillating force is looked for, by the shortest recording and the frames: so many a wave.
FREQUENCIES = 14
#: Step of the finite differences by a coefficient [share of the end of its range].
RESPONSE_STEP = 0.01


@dataclass(frozen=True)
class Piece:
    """A piece that a law may be built of.

    Args:
        name: for people.
        coefficients: names, those of the effect ``law``.
        fixed: values of coefficients that it is not linear in.
    """

    name: str
    coefficients: tuple[str, ...]
    fixed: tuple[tuple[str, float], ...] = ()

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of what it does, different for different fixed values."""
        mark = "".join(f"@{value:g}" for _, value in self.fixed)
        return tuple(c + mark for c in self.coefficients)


def pieces_of(law: Any, taken: tuple[str, ...], times: list[FloatArray]) -> list[Piece]:
    """Everything a law may be built of.

    Args:
        law: the effect.
        taken: coefficients that the model has already.
        times: of the frames of every recording [s].
    """
    out = []
    longest = max(float(t[-1] - t[0]) for t in times)
    fastest = min(0.25 / float(np.median(np.diff(t))) for t in times)
    for name, coefficients in law.families.items():
        if any(c in taken for c in coefficients):
            continue
        if not name.startswith("oscillating"):
            out.append(Piece(name, coefficients))
            continue
        for frequency in np.geomspace(0.75 / longest, min(fastest, 8.0), FREQUENCIES):
            out.append(Piece(name, coefficients, (("frequency", float(frequency)),)))
    return out


def scene_of(problem: Problem, recording: str, unknowns: Unknowns, point: FloatArray) -> tuple[Scene, FloatArray]:
    """The scene of a recording with the parameters of ``point``, and the lumped vertex masses ``(V,)`` [kg]."""
    values = unknowns.space.as_dict(unknowns.space.from_unit(np.clip(point[: len(unknowns.space)], 0.0, 1.0)))
    known = {k: v for k, v in {**problem.fixed, **values}.items() if "." not in k}
    scale = known.pop("scale", 1.0)
    gravity = np.array([0.0, 0.0, -STANDARD_GRAVITY])
    scene = problem.scenarios[recording].scene(with_fields(problem.material, known), gravity, scale)
    return scene, scene.body.vertex_measures * scene.material.density + scene.loads


def responses(
    objective: ForceObjective, law: type[Effect], pieces: list[Piece], estimate: Estimate
) -> dict[str, FloatArray]:
    """Change of all residuals ``(N,)`` for a coefficient of one, by column, where the model follows the data.

    There, positions and velocities are those of the real object and not of a wrong model. What a term does is
    simulated; an oscillation at one of many frequencies is smooth, and goes through the sensitivities to the force.
    """
    steps = {c.name: RESPONSE_STEP * max(abs(c.low), c.high) for c in law.coefficients}
    simple = tuple(dict.fromkeys(c for p in pieces if not p.fixed for c in p.coefficients))
    parts: dict[str, list[FloatArray]] = {}
    for r in range(len(estimate.unknowns.recordings)):
        told = objective.derivatives(estimate, r, {f"{law.name}.{c}": steps[c] for c in simple})
        for c, column in zip(simple, told, strict=True):
            parts.setdefault(c, []).append(column)
        for p in pieces:
            for c, name in zip(p.coefficients, p.columns, strict=True):
                if p.fixed:
                    parts.setdefault(name, []).append(_smooth(law(**{c: 1.0}, **dict(p.fixed)), objective, estimate, r))
    return {column: np.concatenate(p) for column, p in parts.items()}


def _smooth(effect: Effect, objective: ForceObjective, estimate: Estimate, r: int) -> FloatArray:
    """Change of the residuals ``(N,)`` of one recording by the force of ``effect`` along the path."""
    u, problem = estimate.unknowns, objective.pool.problem
    times, path = problem.scenarios[u.recordings[r]].times, estimate.paths[r]
    scene, masses = scene_of(problem, u.recordings[r], u, estimate.point)
    force = effect.bind(scene, masses)
    assert force is not None
    fast = velocities_of(times, path)
    pushed = [force(t, State(x, v)) / masses[:, None] for t, x, v in zip(times.tolist(), path, fast, strict=True)]
    slope = estimate.slopes[r][:, u.starts[r] : u.starts[r + 1]]
    return np.asarray(slope @ u.bases[r].project(times, np.array(pushed)))
