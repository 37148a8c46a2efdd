"""A right effect that rests in a side valley is not overtaken by a look-alike."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_verdict import COUNT, candidate, evidence

from muslin.core.arrays import FloatArray
from muslin.inference.criticism.candidate import Candidate
from muslin.inference.criticism.settle import settled
from muslin.inference.criticism.stage import Stage
from muslin.inference.criticism.verdict import Decision, Evidence, decide
from muslin.inference.polish import Polished


class Bench:
    """Stands in for rollouts: from other parameters a fit comes down to ``floors`` [noise variances].

    Held-out motions move by ``shift`` [noise variances] with any effect.
    """

    count, before_pairs = 0, 100.0

    def __init__(self, floors: dict[str, float], budget: bool = True, shift: float = np.inf) -> None:
        self.floors, self.budget, self.shift, self.asked = floors, budget, shift, list[str]()
        self.study = SimpleNamespace(config=SimpleNamespace(study=SimpleNamespace(seed=1)))

    def may_go_on(self, until: float = np.inf) -> bool:
        return self.budget and self.count < until

    def polished(self, effects: tuple[str, ...], unit: FloatArray, evaluations: int) -> Polished:
        name = effects[-1] if effects else "plain"
        self.asked.append(name)
        rss = self.floors[name] if unit[0] != 0.5 else 9 * COUNT  # 0.5: where the first fit rests
        return replace(candidate("x", rss).fit, unit=unit)

    def roughly_polished(
        self, effects: tuple[str, ...], start: FloatArray, evaluations: int, known: FloatArray | None
    ) -> Polished:
        return self.polished(effects, start, evaluations)

    def roughly_searched(self, effects: tuple[str, ...], start: FloatArray, evaluations: int) -> Polished:
        return self.polished(effects, start, evaluations)

    def quick(self, effects: tuple[str, ...]) -> SimpleNamespace:
        return SimpleNamespace(many=lambda points: [np.ones(3) for _ in points])

    def evidence(self, effects: tuple[str, ...], plain: Polished, candidates: Sequence[Candidate]) -> Evidence:
        return evidence(plain.rss, *(replace(c, held_out_shift=self.shift) for c in candidates))


def stage(*candidates: Candidate) -> Stage:
    e = evidence(9 * COUNT, *candidates)
    return Stage((), candidate("x", 9 * COUNT).fit, {}, e, decide(e))


def test_the_right_effect_overtakes_a_look_alike() -> None:
    before = stage(candidate("latency", 1.4 * COUNT), candidate("lag", 1.6 * COUNT))
    assert before.decision.effects == ("latency",)
    bench = Bench({"latency": 1.4 * COUNT, "lag": COUNT, "plain": 9 * COUNT})
    after = settled(bench, before)  # type: ignore[arg-type]
    assert (after.decision.verdict, after.decision.effects) == ("named", ("lag",))
    assert after.evidence.left(after.chosen) == 0.0


def test_a_search_that_ended_by_itself_is_not_gone_on_with() -> None:
    """More evaluations from there gain nothing; other parameters are tried at once."""
    drag = candidate("drag", 2.0 * COUNT)
    for rested in (True, False):
        bench = Bench({"drag": 2.0 * COUNT, "plain": 9 * COUNT})
        settled(bench, stage(replace(drag, fit=replace(drag.fit, rested=rested))))  # type: ignore[arg-type]
        assert bench.asked.count("drag") == (2 if rested else 3)  # two are from other parameters


def test_rivals_are_left_alone_where_the_leader_leaves_noise() -> None:
    bench = Bench({"drag": COUNT, "plain": 9 * COUNT})
    after = settled(bench, stage(candidate("drag", 1.5 * COUNT), candidate("lag", 1.6 * COUNT)))  # type: ignore[arg-type]
    assert after.decision.effects == ("drag",) and "lag" not in bench.asked
    assert after.chosen.rss == pytest.approx(COUNT)


def test_held_out_motions_that_are_too_gentle_stay_so_once_it_is_fitted_further() -> None:
    """Nothing there gets better by it, nor would it if it were missing."""
    gentle = replace(candidate("drag", 1.5 * COUNT, held_out=0.010), held_out_shift=2.0)
    after = settled(Bench({"drag": COUNT, "plain": 9 * COUNT}, shift=2.0), stage(gentle))  # type: ignore[arg-type]
    assert after.decision == Decision("named", ("drag",)) and not after.chosen.shown_held_out
    strong = settled(Bench({"drag": COUNT, "plain": 9 * COUNT}, shift=20.0), stage(gentle))  # type: ignore[arg-type]
    assert strong.decision.verdict == "none"


def test_a_better_start_does_not_pass_for_an_effect() -> None:
    bench = Bench({"drag": COUNT, "plain": COUNT})  # the model as it is comes down as far from there
    assert settled(bench, stage(candidate("drag", 3 * COUNT))).decision.verdict == "no-misfit"  # type: ignore[arg-type]


def test_what_passes_without_a_refit_is_refitted_before_it_is_named() -> None:
    """The two that were refitted do harm on held-out motions."""
    third = replace(candidate("drag", 2.2 * COUNT), refitted=False)
    before = stage(candidate("lag", 2.0 * COUNT, held_out=0.02), third)
    assert before.decision == Decision("cannot-tell", (), unfinished=True)
    after = settled(Bench({"drag": COUNT, "plain": 9 * COUNT}), before)  # type: ignore[arg-type]
    assert (after.decision.verdict, after.decision.effects) == ("named", ("drag",)) and after.chosen.refitted


@pytest.mark.parametrize("alone, asked", [(4.0 * COUNT, []), (1.5 * COUNT, ["drag"])])
def test_what_is_kept_for_pairs_is_not_spent_on_one_that_explains_too_little(alone: float, asked: list[str]) -> None:
    bench = Bench({"drag": COUNT, "plain": 9 * COUNT})
    bench.count = 101
    settled(bench, stage(candidate("drag", alone)))  # type: ignore[arg-type]
    assert [name for name in dict.fromkeys(bench.asked) if name != "plain"] == asked


def test_nothing_is_done_without_a_budget_or_a_refit() -> None:
    empty = Bench({}, budget=False)
    assert settled(empty, stage(candidate("drag", 2 * COUNT))).evidence.candidates[0].rss == pytest.approx(2 * COUNT)  # type: ignore[arg-type]
    seen = stage(replace(candidate("drag", 2 * COUNT), refitted=False))
    assert settled(Bench({}), seen) is seen  # type: ignore[arg-type]
