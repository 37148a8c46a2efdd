"""A guessed law as an effect in the model: refitted together with the parameters, and held out."""

from dataclasses import dataclass, field, replace

import numpy as np

from ....core.arrays import FloatArray
from ....core.parameters import Parameter, ParameterSpace
from ....core.study import Problem, SimulationPool
from ...discrepancy import Discrepancy
from ...noise import Noise
from ...polish import Objective, Polished, polish
from ...residuals import Offsets
from ..held_out import held_out_residuals
from .estimate import ForceObjective
from .held import held_objective
from .library import Piece
from .search import Guess

#: Name of the effect.
LAW = "law"
#: Name of the piece that pulls everything the same way.
PUSH = "uniform acceleration"
#: Least-squares evaluations for every guess, and for those that lead.
FIRST_EVALUATIONS, MORE_EVALUATIONS = 12, 40
#: Coefficients nearer to zero than this are dropped [standard deviations].
CLEAR = 3.0
#: A coefficient so near to an end of its range is held back by it [of the width].
END = 0.005
#: Most coefficients hold for any size; this one only says where others act, and is not dropped for being small.
_PLACES = ("frequency",)


@dataclass(frozen=True, eq=False)
class RefittedLaw:
    """The model with a law.

    Args:
        pieces: that it was made of; those of which no coefficient is left are no part of it.
        space: parameters and coefficients.
        base: number of the parameters that are not coefficients of the law.
        fit: polished together, in units of the noise.
        held_out: root mean square error on each held-out recording [unit].
    """

    pieces: tuple[Piece, ...]
    space: ParameterSpace
    base: int
    fit: Polished
    held_out: dict[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What it is made of."""
        left = set(self.coefficients)
        return " + ".join(dict.fromkeys(_called(p, left) for p in self.pieces if left & set(p.coefficients)))

    @property
    def rss(self) -> float:
        return self.fit.rss

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of the terms."""
        return tuple(n.removeprefix(f"{LAW}.") for n in self.space.names[self.base :])

    @property
    def at_end(self) -> tuple[str, ...]:
        """Names of the terms whose range ends before the recordings are content."""
        unit = self.fit.unit[self.base :]
        told = zip(self.coefficients, unit.tolist(), strict=True)
        return tuple(n for n, u in told if n not in _PLACES and not END < u < 1 - END)

    @property
    def terms(self) -> dict[str, tuple[float, float, str]]:
        """Mean, standard deviation and unit of every coefficient."""
        own = list(self.space)[self.base :]
        mean = self.space.from_unit(self.fit.unit)[self.base :]
        sd = np.sqrt(np.diag(self.fit.widened)[self.base :])
        return {
            p.name.removeprefix(f"{LAW}."): (float(m), float(s * (p.high - p.low)), p.unit)
            for p, m, s in zip(own, mean, sd, strict=True)
        }


def _called(piece: Piece, left: set[str]) -> str:
    """The name of a piece of which these coefficients are left: without its stiffness a spring is a steady push."""
    stiffness = piece.coefficients[0]
    return PUSH if stiffness.startswith("spring") and stiffness not in left else piece.name


def distinct(laws: list[RefittedLaw]) -> list[RefittedLaw]:
    """One law of each set of coefficients, the one of least residual."""
    out: dict[frozenset[str], RefittedLaw] = {}
    for law in sorted(laws, key=lambda c: c.rss):
        out.setdefault(frozenset(law.terms), law)
    return list(out.values())


def _without(law: RefittedLaw, coefficient: str) -> RefittedLaw:
    """Not yet polished; what only says where the coefficient acts goes with the last one that acts there."""
    left = set(law.coefficients) - {coefficient}
    left -= {name for p in law.pieces if not left & set(p.coefficients) for name, _ in p.fixed}
    gone = {f"{LAW}.{name}" for name in set(law.coefficients) - left}
    kept = [k for k, name in enumerate(law.space.names) if name not in gone]
    space = ParameterSpace(tuple(list(law.space)[k] for k in kept))
    return RefittedLaw(law.pieces, space, law.base, replace(law.fit, unit=law.fit.unit[kept]))


class Refits:
    """Refits laws beside one another.

    Args:
        pool: whose problem has the effect ``law``.
        problem: the study's, without it.
        noise, offsets: of the measurement.
        discrepancy: what the model cannot repeat.
        parameters: of the effect, by coefficient.
    """

    def __init__(
        self,
        pool: SimulationPool,
        problem: Problem,
        noise: Noise,
        offsets: Offsets,
        discrepancy: Discrepancy,
        parameters: dict[str, Parameter],
    ) -> None:
        self.pool, self.problem, self.noise, self.offsets = pool, problem, noise, offsets
        self.discrepancy = discrepancy
        self.parameters = parameters

    def objective(self, coefficients: tuple[str, ...]) -> Objective:
        extra = tuple(self.parameters[c] for c in coefficients)
        space = self.problem.space + ParameterSpace(extra)
        names = self.problem.fit_on
        return Objective(self.pool, space, names, self.noise, self.offsets, discrepancy=self.discrepancy)

    def first(self, guess: Guess, unit: FloatArray, force: ForceObjective) -> RefittedLaw:
        """The law polished on a held model from where the search left it; ``unit`` are the parameters there."""
        names = tuple(guess.coefficients)
        objective = held_objective(force, self.objective(names).space)
        base = len(self.problem.space)
        told = np.array(list(guess.coefficients.values()))
        sized = np.array([n not in _PLACES for n in names])
        starts = []
        for shift, share in ((1.0, 1.0), (0.0, 1.0), (0.0, 0.5)):
            values = np.where(sized, share, 1.0) * told
            theta = ParameterSpace(tuple(objective.space)[base:]).to_unit(values)
            starts.append(np.clip(np.concatenate([unit + shift * guess.shift, theta]), 0.01, 0.99))
        sizes = [np.inf if w is None else float(w @ w) for w in objective.many(np.stack(starts))]
        fit = polish(objective, starts[int(np.argmin(sizes))], FIRST_EVALUATIONS)
        return RefittedLaw(guess.pieces, objective.space, base, fit)

    def more(self, law: RefittedLaw) -> RefittedLaw:
        """Polished to the end, without coefficients that are not clearly off zero."""
        law = self._polished(law)
        while len(law.space) - law.base > 1:
            faint = self._faintest(law)
            if faint is None:
                break
            law = self._polished(_without(law, faint))
        return replace(law, held_out=self.held_out(law.space, law.fit.unit))

    def _polished(self, law: RefittedLaw) -> RefittedLaw:
        objective = self.objective(law.coefficients)
        fit = polish(objective, law.fit.unit, MORE_EVALUATIONS)
        return replace(law, space=objective.space, fit=fit)

    def _faintest(self, law: RefittedLaw) -> str | None:
        """The coefficient that is least off zero, if it is not clearly so."""
        clear = {n: abs(mean) / max(sd, 1e-300) for n, (mean, sd, _) in law.terms.items() if n not in _PLACES}
        name = min(clear, key=clear.__getitem__)
        if clear[name] >= CLEAR or len(clear) == 1:
            return None
        return name

    def held_out(self, space: ParameterSpace, unit: FloatArray) -> dict[str, float]:
        """Root mean square error on every held-out recording [unit]; infinite where it cannot be simulated."""
        found = held_out_residuals(self.pool, self.problem, space, unit, self.noise, self.offsets)
        return {name: float("inf") if r is None else r.rms for name, r in found.items()}
