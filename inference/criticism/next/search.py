"""The search for the best motion within a number of simulations."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from ....core.arrays import FloatArray
from .bench import Bench, Proposal
from .goal import Goal
from .limits import Limits
from .playing import play
from .shapes import Drawn, Known, Shape

#: Shares of the simulations: for what the models predict of all motions, and for a closer look at the promising ones.
FIRST_SHARE, LOOK_SHARE = 0.35, 0.2
#: Motions drawn from the family at most, and at least.
MOST_DRAWN, LEAST_DRAWN = 64, 4
#: Standard deviations of the changes to the best ones, a generation each, in the unit cube of the family.
REFINEMENTS = (0.15, 0.06)


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found.

    Args:
        best: proposal that was looked at; None if nothing could be simulated.
        known: the ready-made ones that were looked at.
        tried: motions that were simulated.
        failed: of them.
    """

    best: Proposal | None
    known: list[Proposal]
    tried: int
    failed: int


class Search:
    """Space-filling draws and ready-made motions, a closer look at the promising ones, and changes to the best.

    Args:
        bench: where motions are simulated.
        goal: what counts.
        limits: of the robot.
        start: poses of the grippers ``(G, 7)``.
        fastest: frequency of the family [Hz].
        seed: of the draws.
    """

    def __init__(self, bench: Bench, goal: Goal, limits: Limits, start: FloatArray, fastest: float, seed: int) -> None:
        self.bench, self.goal, self.limits, self.start, self.fastest = bench, goal, limits, start, fastest
        self._sobol = qmc.Sobol(Drawn.SIZE, rng=np.random.default_rng([seed, 61]))
        self._rng = np.random.default_rng([seed, 67])
        self._looked: list[tuple[float, Proposal]] = []
        self._tried: list[Proposal] = []

    def run(self, known: Sequence[Known], simulations: int) -> Found:
        """Search with about so many rollouts; the ready-made ones are always among what is tried."""
        each, closer = self.bench.cost_of_points, self.bench.cost_of_views
        drawn = int(np.clip(FIRST_SHARE * simulations / each - len(known), LEAST_DRAWN, MOST_DRAWN))
        points = np.asarray(self._sobol.random(2 ** int(np.ceil(np.log2(drawn)))))[:drawn]
        proposals = [self._proposal(s) for s in (*known, *(self._drawn(u) for u in points))]
        self._predict(proposals)
        order = sorted((p for p in proposals if not p.failed), key=self._promise, reverse=True)
        first = max(1, int(LOOK_SHARE * simulations / closer))
        # what recording the same once more would do is said beside the answer
        again = [p for p in order[first:] if isinstance(p.shape, Known) and p.shape.recorded][:1]
        self._look([*order[:first], *again])
        # no ready-made one may be better than the answer: those that promise more than was reached are looked at
        left = [p for p in order[first:] if isinstance(p.shape, Known) and p not in again]
        rest = [p for p in left if self._promise(p) > self._best_value()]
        self._look(rest[: max(1, int(0.2 * simulations / closer))])
        for k, size in enumerate(REFINEMENTS):
            self._refine(size, (simulations - self.bench.count) / (len(REFINEMENTS) - k))
        best = max(self._looked, key=lambda x: x[0])[1] if self._looked else None
        seen = [p for _, p in self._looked if isinstance(p.shape, Known)]
        return Found(best, seen, len(self._tried), sum(p.failed for p in self._tried))

    def _proposal(self, shape: Shape) -> Proposal:
        return Proposal(shape, play(shape, self.start, self.limits))

    def _drawn(self, unit: FloatArray) -> Drawn:
        return Drawn(np.asarray(unit, float), self.limits, self.fastest)

    def _promise(self, proposal: Proposal) -> float:
        if proposal.points is None:
            return -np.inf
        noise = self.bench.noise
        return self.goal.bound(proposal.points, noise.sd / np.sqrt(noise.information))

    def _best_value(self) -> float:
        return max((v for v, _ in self._looked), default=-np.inf)

    def _predict(self, proposals: list[Proposal]) -> None:
        self._tried += proposals
        self.bench.predict(proposals)

    def _look(self, proposals: list[Proposal]) -> None:
        self.bench.look(proposals)
        self._looked += [(self.goal.value(p.views), p) for p in proposals if p.views and not p.failed]

    def _refine(self, size: float, simulations: float) -> None:
        """Change the best shapes a little, most of all the very best one, and look at what promises most."""
        each, closer = self.bench.cost_of_points, self.bench.cost_of_views
        look = int(0.5 * simulations / (each + closer))
        count = look + int(0.5 * simulations / each)
        if look < 1 or not self._looked:
            return
        ranked = sorted(self._looked, key=lambda x: -x[0])
        drawn = next((p for _, p in ranked if isinstance(p.shape, Drawn)), ranked[0][1])
        parents = [ranked[0][1], ranked[0][1], ranked[min(1, len(ranked) - 1)][1], drawn]
        children = [self._proposal(parents[k % 4].shape.varied(size, self._rng)) for k in range(count)]
        self._predict(children)
        self._look(sorted((c for c in children if not c.failed), key=self._promise, reverse=True)[:look])
