"""A second effect: beside tied ones, which it may tell apart, and in pairs that no effect alone stands for."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from test_verdict import COUNT, candidate, evidence

from muslin.core.arrays import FloatArray
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.criticism import stepwise
from muslin.inference.criticism.candidate import Candidate
from muslin.inference.criticism.caveats import further
from muslin.inference.criticism.linear import Look
from muslin.inference.criticism.pairs import Pair
from muslin.inference.criticism.stage import Stage
from muslin.inference.criticism.stepwise import Doubt, Findings, borne_out, confirmed, find
from muslin.inference.criticism.verdict import Decision, decide
from muslin.inference.polish import Polished

Hints = Mapping[str, FloatArray]
NO_HINTS: Hints = MappingProxyType({})


class Bench:
    """Stands in for rollouts: a fit of these effects leaves so much [noise variances]."""

    def __init__(self, left: dict[tuple[str, ...], float], held_out_of_wind: float) -> None:
        self.left, self.held_out_of_wind = left, held_out_of_wind

    def may_go_on(self) -> bool:
        return True

    def space(self, effects: tuple[str, ...]) -> ParameterSpace:
        names = ["stiffness", *(f"{e}.strength" for e in effects)]
        return ParameterSpace(tuple(Parameter(n, "1", 0, 1) for n in names))

    def searched(self, effects: tuple[str, ...], unit: FloatArray, evaluations: int) -> Polished:
        assert len(unit) == len(self.space(effects))
        white = np.full(int(COUNT), np.sqrt(self.left[effects] / COUNT))
        return Polished(unit, white, np.zeros((len(white), len(unit))), np.eye(len(unit)), COUNT)

    def judged(self, c: Candidate) -> Candidate:
        return replace(c, held_out_white=self.held_out_of_wind if "wind.strength" in c.space.names else 1.0)


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> tuple[Findings, list[tuple[str, ...]]]:
    """What is found where tilt and wind leave so much alone and with drag, and the stages that were run."""
    alone, with_tilt, with_wind = (COUNT * x for x in request.param[:3])
    left = {("tilt",): alone, ("wind",): alone + 1.0, ("tilt", "drag"): with_tilt, ("wind", "drag"): with_wind}
    bench, stages = Bench(left | {("drag",): 8 * COUNT}, request.param[3]), list[tuple[str, ...]]()

    def run_stage(
        work: Bench, effects: tuple[str, ...], names: list[str], start: FloatArray, hints: Hints = NO_HINTS
    ) -> Stage:
        stages.append(effects)
        if not effects:
            return first_stage({"tilt": alone, "wind": alone + 1.0, "drag": 8 * COUNT})
        if len(effects) > 1:  # nothing more is missing
            e = evidence(with_tilt, candidate("mass", with_tilt))
            return Stage(effects, bench.searched(("tilt", "drag"), start, 1), {}, e, Decision("no-misfit", ()))
        space = bench.space((*effects, "drag"))
        fit = bench.searched((*effects, "drag"), np.full(3, 0.5), 1)
        drag = Candidate("drag", space, 2, fit, {"other": 0.003}, request.param[4], refitted=True)
        e = evidence(alone, drag)
        named = Decision("named", ("drag",)) if with_tilt < 0.95 * alone else Decision("none", ())
        return Stage(effects, candidate("x", alone).fit, {}, e, named)

    monkeypatch.setattr(stepwise, "run_stage", run_stage)
    monkeypatch.setattr(stepwise, "settled", lambda work, stage: stage)
    monkeypatch.setattr(stepwise, "promising_pairs", lambda work, stage: [])
    return find(bench, ["tilt", "wind", "drag"], np.full(1, 0.5)), stages  # type: ignore[arg-type]


def first_stage(left: dict[str, float]) -> Stage:
    """Of candidates that leave so much of a misfit of nine times the noise."""
    candidates = {n: candidate(n, rss) for n, rss in left.items()}
    looks = {n: look(c) for n, c in candidates.items()}
    e = evidence(9 * COUNT, *candidates.values())
    return Stage((), candidate("x", 9 * COUNT).fit, looks, e, decide(e))


def look(c: Candidate) -> Look:
    """Nothing moves; the coefficient is at zero."""
    start = np.array([0.5, 0.0])
    return Look(c.name, c.space, start, c.fit.white, np.zeros((len(c.fit.white), 2)), start, c.rss, 0.1, 1.0)


def outcome(
    alone: float, with_tilt: float, with_wind: float, held_out: float = 2.0, tilt_held_out: float = 1.0
) -> pytest.MarkDecorator:
    """What is left of a misfit of 9; and held out, wind and drag together, and tilt and drag."""
    return pytest.mark.parametrize("found", [(alone, with_tilt, with_wind, held_out, tilt_held_out)], indirect=True)


@outcome(2.0, 1.0, 1.8)
def test_a_second_effect_tells_the_tied_ones_apart(found: tuple[Findings, list[tuple[str, ...]]]) -> None:
    assert (found[0].verdict, found[0].effects, found[0].further) == ("named", ("tilt", "drag"), ())


@outcome(2.0, 1.8, 1.0, held_out=0.9)
def test_it_may_be_the_other_one(found: tuple[Findings, list[tuple[str, ...]]]) -> None:
    assert (found[0].verdict, found[0].effects) == ("named", ("wind", "drag"))
    assert found[0].after.space.names == ("stiffness", "wind.strength", "drag.strength")


@outcome(2.0, 1.0, 1.0)
def test_or_leave_them_tied_and_be_missing_beside_either(found: tuple[Findings, list[tuple[str, ...]]]) -> None:
    assert (found[0].verdict, found[0].effects, found[0].further) == ("tied", ("tilt", "wind"), ("drag",))
    for (names, rival), lead in zip(found[0].rivals, ("tilt", "wind"), strict=True):  # for an experiment to tell apart
        assert names == (lead, "drag") and rival.space.names == ("stiffness", f"{lead}.strength", "drag.strength")


@outcome(2.0, 1.0, 1.8, held_out=0.9)
def test_what_does_better_on_other_motions_is_not_ruled_out(found: tuple[Findings, list[tuple[str, ...]]]) -> None:
    assert (found[0].verdict, found[0].effects, found[0].further) == ("tied", ("tilt", "wind"), ("drag",))


@outcome(2.0, 1.0, 1.8, held_out=5.1, tilt_held_out=5.0)
def test_nor_what_misses_them_by_much_as_the_other_does(found: tuple[Findings, list[tuple[str, ...]]]) -> None:
    assert (found[0].verdict, found[0].effects, found[0].further) == ("tied", ("tilt", "wind"), ("drag",))


@outcome(2.0, 1.0, 1.8, held_out=6.0, tilt_held_out=5.0)
def test_but_what_misses_them_by_more(found: tuple[Findings, list[tuple[str, ...]]]) -> None:
    assert (found[0].verdict, found[0].effects) == ("named", ("tilt", "drag"))


@outcome(2.0, 2.0, 2.0)
def test_where_there_is_none_they_stay_tied(found: tuple[Findings, list[tuple[str, ...]]]) -> None:
    assert (found[0].verdict, found[0].effects, found[0].further) == ("tied", ("tilt", "wind"), ())


@outcome(1.0, 1.0, 1.0)
def test_no_other_is_looked_for_where_nothing_is_left(found: tuple[Findings, list[tuple[str, ...]]]) -> None:
    assert (found[0].verdict, found[1]) == ("tied", [()])


def test_what_is_missing_beside_either_is_told() -> None:
    said = further({"verdict": "tied", "effects": ["tilt", "wind"], "further": ["drag"]})
    assert "whichever of tilt, wind it is: drag" in said


@pytest.fixture
def paired(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> tuple[Findings, Hints]:
    """What is found where camera, grasp and tilt leave so much alone, and grasp and tilt together a number; hints.

    A third number is what these two leave on held-out motions [noise variances]; the plain model leaves eleven. A
    fourth value says that the budget has ended, or ends before the second effect is refitted.
    """
    alone, together = {n: COUNT * x for n, x in request.param[0].items()}, COUNT * request.param[1]
    ends = request.param[3] if len(request.param) > 3 else "never"
    seen: dict[str, FloatArray] = {}
    bench = Bench({("tilt",): 6 * COUNT, ("grasp",): 5 * COUNT}, 1.0)
    first = first_stage(alone)

    def both() -> Candidate:
        fit = bench.searched(("x", "y"), np.array([0.5, 0.3, 0.7]), 1)
        return Candidate("tilt", bench.space(("grasp", "tilt")), 2, fit, {"other": 0.003}, 1.0, refitted=True)

    bench.left["x", "y"] = together

    def run_stage(
        work: Bench, effects: tuple[str, ...], names: list[str], start: FloatArray, hints: Hints = NO_HINTS
    ) -> Stage:
        if not effects:
            return first
        if effects != ("grasp",):
            e = evidence(together, candidate("slip", together))
            return Stage(effects, candidate("x", together).fit, {}, e, Decision("no-misfit", ()))
        seen.update(hints)
        e = evidence(alone["grasp"], both())
        named = Decision("cannot-tell", (), unfinished=True) if ends == "later" else Decision("named", ("tilt",))
        return Stage(effects, first.candidate("grasp").fit, {}, e, named)

    monkeypatch.setattr(stepwise, "run_stage", run_stage)
    monkeypatch.setattr(stepwise, "settled", lambda work, stage: stage)
    pair = Pair(first.candidate("grasp"), both())
    monkeypatch.setattr(stepwise, "promising_pairs", lambda work, stage: [pair])
    bench.may_go_on = lambda: ends != "before"  # type: ignore[method-assign]
    joint = evidence(9 * COUNT, replace(both(), held_out_white=(*request.param, 1.0)[2]))
    bench.jointly = lambda *_: joint  # type: ignore[attr-defined]
    return find(bench, ["camera", "grasp", "tilt"], np.full(1, 0.5)), seen  # type: ignore[arg-type]


NEITHER = {"camera": 7.0, "grasp": 5.5, "tilt": 6.0}
CAMERA = {"camera": 2.5, "grasp": 5.5, "tilt": 6.0}  # named: it leaves less than a fifth of the misfit


@pytest.mark.parametrize("paired", [(NEITHER, 1.0), (CAMERA, 1.0)], indirect=True)
def test_a_pair_is_named_where_none_of_it_is_alone_or_another_stands_in_for_it(
    paired: tuple[Findings, Hints],
) -> None:
    assert (paired[0].verdict, paired[0].effects) == ("named", ("grasp", "tilt"))


@pytest.mark.parametrize("paired", [(NEITHER, 4.5)], indirect=True)
def test_a_pair_that_leaves_much_is_not_named(paired: tuple[Findings, Hints]) -> None:
    assert (paired[0].verdict, paired[0].effects) == ("none", ())
    assert [p.names for p in paired[0].together] == [("grasp", "tilt")]
    assert not paired[0].unjudged


@pytest.mark.parametrize("paired", [(NEITHER, 1.0, 1.0, "before"), (NEITHER, 1.0, 1.0, "later")], indirect=True)
def test_a_pair_that_the_budget_leaves_unjudged_is_told_as_that(paired: tuple[Findings, Hints]) -> None:
    assert paired[0].verdict == "none" and paired[0].unjudged
    assert [p.names for p in paired[0].together] == [("grasp", "tilt")]


@pytest.mark.parametrize("paired", [(NEITHER, 1.0, 10.0)], indirect=True)
def test_a_pair_that_does_not_lessen_the_held_out_error_is_not_named(paired: tuple[Findings, Hints]) -> None:
    assert (paired[0].verdict, paired[0].effects) == ("none", ())


@pytest.mark.parametrize("paired", [(CAMERA, 2.2)], indirect=True)
def test_a_pair_that_is_little_ahead_of_what_is_named_does_not_replace_it(paired: tuple[Findings, Hints]) -> None:
    assert (paired[0].verdict, paired[0].effects) == ("named", ("camera",))


@pytest.mark.parametrize("paired", [(NEITHER, 1.0)], indirect=True)
def test_second_effects_are_looked_at_where_they_were_in_a_pair_and_alone(paired: tuple[Findings, Hints]) -> None:
    assert paired[1]["tilt"] == pytest.approx(np.array([[0.5, 0.3, 0.7], [0.5, 0.5, 0.5]]))


@pytest.mark.parametrize(
    "left, held_out, doubt",
    [
        (2.4, 0.003, None),
        (3.2, 0.003, Doubt("tilt", pytest.approx(0.73, abs=0.01), "little")),  # type: ignore[arg-type]
        (1.0, 0.0095, Doubt("tilt", 1.0, "held-out")),
    ],
)
def test_a_name_stands_only_if_nothing_speaks_against_it_where_it_fits(
    left: float, held_out: float, doubt: Doubt | None
) -> None:
    first = first_stage({"tilt": 1.2 * COUNT, "wind": 6 * COUNT})
    found = Findings("named", ("tilt",), first, first, first.chosen)
    joint = evidence(9 * COUNT, candidate("tilt", left * COUNT, held_out=held_out))
    told = confirmed(found, joint)
    assert told.doubt == doubt
    if doubt is None:
        assert told is found
    else:
        assert (told.verdict, told.effects, told.after.name) == ("none", (), "tilt")
        for other in (replace(found, verdict="tied"), replace(found, effects=("tilt", "wind"))):
            assert confirmed(other, joint) is other


@pytest.mark.parametrize("shift, after, named", [(100.0, 1.005, True), (100.0, 1.02, False), (4.0, 1.02, True)])
def test_a_name_does_not_make_a_users_held_out_error_larger(shift: float, after: float, named: bool) -> None:
    """Unless these motions are too gentle to show the effect."""
    first = first_stage({"tilt": 1.2 * COUNT, "wind": 6 * COUNT})
    found = Findings("named", ("tilt",), first, first, first.chosen)
    joint = evidence(9 * COUNT, replace(candidate("tilt", 1.2 * COUNT), held_out_shift=shift))
    told = borne_out(found, joint, 0.003, 0.003 * after)
    if named:
        assert told is found
    else:
        assert (told.verdict, told.effects) == ("none", ())
        assert told.doubt == Doubt("tilt", pytest.approx(1.0, abs=0.05), "held-out")  # type: ignore[arg-type]
    assert borne_out(replace(found, verdict="tied"), joint, 0.003, 0.004).verdict == "tied"


def test_a_doubted_name_for_what_may_be_noise_leaves_no_misfit() -> None:
    first = first_stage({"tilt": 0.9 * COUNT, "wind": 0.99 * COUNT})
    first = replace(first, evidence=replace(first.evidence, rss_plain=COUNT))
    found = Findings("named", ("tilt",), first, first, first.candidate("tilt"))
    assert borne_out(found, first.evidence, 0.003, 0.004).verdict == "no-misfit"


@pytest.mark.parametrize("names, rest", [(["drag"], Decision("none", ())), (["drag", "lag"], None)])
def test_where_all_candidates_are_named_none_explains_what_is_left(names: list[str], rest: Decision | None) -> None:
    first = first_stage({"drag": 2 * COUNT})
    found = Findings("named", ("drag",), first, first, first.chosen)
    bench = Bench({}, 1.0)
    bench.may_go_on = lambda: names == ["drag"]  # type: ignore[method-assign]
    assert stepwise._forward(bench, names, found, []).rest == rest  # type: ignore[arg-type]
