"""How a diagnosis spends its simulations, and what it says of a misfit that stays."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_verdict import COUNT, candidate, evidence

from muslin.core.arrays import FloatArray
from muslin.inference.criticism import work
from muslin.inference.criticism.diagnose import _rest
from muslin.inference.criticism.linear import Look
from muslin.inference.criticism.stage import MORE_EVALUATIONS, Stage, _leaders, _Tournament, from_there_too
from muslin.inference.criticism.verdict import Decision, decide
from muslin.inference.criticism.work import Work, search_simulations
from muslin.inference.polish import Polished


def test_a_budget_ends_where_it_is_told_to_and_that_is_remembered() -> None:
    spent = SimpleNamespace(count=650, limit=850, cut_short=False)
    assert Work.may_go_on(spent) and not spent.cut_short  # type: ignore[arg-type]
    assert not Work.may_go_on(spent, until=645.0) and spent.cut_short  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "kind, takes, pieces, fitted, search",
    [
        ("cloth", 1, 1, 300, 748), ("cloth", 4, 1, 1000, 1496), ("rope", 2, 1, 500, 2125), ("rope", 2, 4, 500, 2125),
        ("solid", 2, 1, 500, 850), ("cloth", 2, 1, 780, 514), ("cloth", 2, 1, 5000, 308),
    ],
)  # fmt: skip
def test_more_recordings_and_quick_objects_get_more_simulations_and_a_long_fit_leaves_fewer(
    kind: str, takes: int, pieces: int, fitted: int, search: int
) -> None:
    scenario = SimpleNamespace(body=SimpleNamespace(kind=kind))
    names = [str(k) for k in range(takes * pieces)]
    problem = SimpleNamespace(fit_on=names, scenarios=dict.fromkeys(names, scenario), pieces=float(pieces))
    assert search_simulations(problem, fitted) == search  # type: ignore[arg-type]
    assert search_simulations(problem, fitted, asked=300) == 255  # type: ignore[arg-type]


@pytest.mark.parametrize("pieces", [1.0, 4.0])
def test_a_search_leaves_simulations_for_telling_what_it_found(monkeypatch: pytest.MonkeyPatch, pieces: float) -> None:
    monkeypatch.setattr(work, "offsets_of", lambda study: None)
    asked = SimpleNamespace(config=SimpleNamespace(diagnose=SimpleNamespace(draws=4, simulations=1000)))
    problem = SimpleNamespace(
        space=SimpleNamespace(to_unit=lambda samples: samples), pieces=pieces, told_as=lambda n: round(n / pieces)
    )
    fit = SimpleNamespace(samples=np.zeros((9, 1)), derivative_step=1e-3, simulations=300)
    spent = SimpleNamespace(count=int(400 * pieces))
    search = Work(asked, problem, spent, fit)  # type: ignore[arg-type]
    assert search.limit == 850 * pieces  # pieces of a recording count as one simulation ...
    assert search.simulations == 400  # ... wherever they are told of


def test_a_diagnosis_counts_what_its_fit_took(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work, "offsets_of", lambda study: None)
    left = SimpleNamespace(config=SimpleNamespace(diagnose=SimpleNamespace(draws=4, simulations=None)))
    cloth = SimpleNamespace(body=SimpleNamespace(kind="cloth"))
    problem = SimpleNamespace(
        space=SimpleNamespace(to_unit=lambda samples: samples), pieces=1.0, fit_on=["a"], scenarios={"a": cloth}
    )
    limits = [
        Work(
            left,
            problem,
            SimpleNamespace(),
            SimpleNamespace(samples=np.zeros((9, 1)), derivative_step=1e-3, simulations=n),
        ).limit  # type: ignore[arg-type]
        for n in (300, 780)
    ]
    assert limits == [748, 514]


def bench(polished: Callable[..., Polished]) -> tuple[SimpleNamespace, _Tournament]:
    """Rollouts that run out, and a tournament of one candidate, whose fits are given."""
    drag = candidate("drag", 2 * COUNT)
    plain = Polished(np.array([0.5]), drag.fit.white, np.ones((len(drag.fit.white), 1)), np.eye(1), COUNT)
    start = np.array([0.5, 0.0])
    jacobian = np.tile([1.0, 0.5], (len(plain.white), 1))
    look = Look("drag", drag.space, start, plain.white, jacobian, start, plain.rss, 0.1, 1.0)
    config = SimpleNamespace(diagnose=SimpleNamespace(draws=4), study=SimpleNamespace(seed=1))
    work = SimpleNamespace(
        study=SimpleNamespace(config=config, progress=lambda *_: None), starts=np.full((2, 1), 0.5),
        count=0, limit=1000, cut_short=False, polished=polished, roughly_polished=polished,
    )  # fmt: skip
    work.may_go_on = lambda until=np.inf: Work.may_go_on(work, until)  # type: ignore[arg-type]
    return work, _Tournament(work, (), plain, {"drag": look}, {})  # type: ignore[arg-type]


def searching(left: Callable[[FloatArray], float], reached: float = 1.0) -> tuple[_Tournament, list[FloatArray]]:
    """A tournament in which every residual is ``left`` at a point, and the list of where its fits start.

    They all reach ``reached`` [what noise leaves].
    """
    starts: list[FloatArray] = []

    def polished(effects: tuple[str, ...], unit: FloatArray, *_: object) -> Polished:
        starts.append(unit)
        return candidate("drag", reached * COUNT).fit

    work, tournament = bench(polished)
    work.objective = lambda effects: SimpleNamespace(many=lambda points: [np.full(int(COUNT), left(p)) for p in points])
    return tournament, starts


def test_the_leader_is_refitted_though_finding_it_took_long() -> None:
    refitted = []

    def polished(effects: tuple[str, ...], unit: FloatArray, evaluations: int) -> Polished:
        refitted.append(effects)
        return candidate("drag", COUNT).fit

    work, tournament = bench(polished)
    work.count = 800  # most of it went before anything could be refitted
    (found,) = tournament.run()
    assert refitted == [("drag",)] and found.refitted and found.rss == pytest.approx(COUNT)
    assert found.tried


@pytest.mark.parametrize("explains_enough", [True, False])
def test_rivals_are_refitted_before_pairs_are_tried_only_where_one_may_be_named(explains_enough: bool) -> None:
    reached = {"drag": (1.5 if explains_enough else 1.9) * COUNT, "lag": 1.95 * COUNT}
    refitted = []

    def polished(effects: tuple[str, ...], unit: FloatArray, evaluations: int, *_: object) -> Polished:
        if evaluations == MORE_EVALUATIONS:
            refitted.append(effects[-1])
        return candidate(effects[-1], reached[effects[-1]]).fit

    work, tournament = bench(polished)
    work.before_pairs, work.count, tournament.until = 850, 900, 1000
    work.objective = lambda effects: SimpleNamespace(many=lambda points: [np.full(int(COUNT), 3.0) for _ in points])
    without = candidate("plain", (6.0 if explains_enough else 3.0) * COUNT).fit.white
    tournament.plain = replace(tournament.plain, white=without)
    drag = tournament.looks["drag"]
    tournament.looks["lag"] = replace(drag, name="lag", space=candidate("lag", COUNT).space)
    tournament.rng["lag"] = np.random.default_rng(0)
    tournament.run()
    assert refitted == (["drag", "lag"] if explains_enough else ["drag"])


@pytest.mark.parametrize("spent", [True, False])
def test_a_candidate_that_the_budget_does_not_come_to_is_not_tried(spent: bool) -> None:
    work, tournament = bench(lambda effects, unit, *_: candidate("drag", 3 * COUNT).fit)
    work.objective = lambda effects: SimpleNamespace(many=lambda points: [np.full(int(COUNT), 3.0) for _ in points])
    work.count = work.limit if spent else 0
    (found,) = tournament.run()
    assert found.tried is not spent


@pytest.mark.parametrize(("from_there", "reached"), [(1.0, 1.0), (3.0, 2.0)])
def test_a_hint_is_followed_though_it_leaves_more_than_the_model_without(from_there: float, reached: float) -> None:
    tournament, starts = searching(lambda p: 2.0 if p[1] == 0.8 else 3.0, from_there)
    hints = np.array([[0.5, 0.2], [0.5, 0.8]])
    tournament.hints = {"drag": hints}
    tournament.screened = pytest.fail  # type: ignore[assignment, method-assign]
    (found,) = tournament.run()
    assert starts[0] == pytest.approx(hints[1])
    assert found.rss == pytest.approx(reached * COUNT)


def test_the_parameters_make_up_for_an_effect_before_it_is_judged() -> None:
    """The worst point is the best one once a rope that its effect makes softer is made stiffer."""
    count = int(COUNT)
    jacobian = 100.0 * np.column_stack([np.ones(count), np.linspace(-1.0, 1.0, count)])
    tournament = SimpleNamespace(plain=SimpleNamespace(unit=np.array([0.4, 0.5]), jacobian=jacobian))
    rows = [
        (np.array([0.4, 0.5, 0.1]), (-1.0) ** np.arange(count)),  # which no parameter makes up for
        (np.array([0.9, 0.5, 0.3]), np.full(count, 10.0)),  # elsewhere derivatives are others
        (np.array([0.4, 0.5, 0.6]), np.full(count, -20.0)),
    ]
    found = _Tournament.made_up(tournament, rows)  # type: ignore[arg-type]
    assert found == pytest.approx(np.array([0.6, 0.5, 0.6]), abs=1e-3)
    assert _Tournament.made_up(tournament, rows[1:2]) is None  # type: ignore[arg-type]


def test_a_search_goes_on_from_where_the_parameters_make_up_for_an_effect() -> None:
    # the effect does harm, which a parameter far below all that is screened makes up for
    tournament, starts = searching(lambda p: 0.5 if p[0] < 0.01 < p[1] else 3.0)
    tournament.run()
    assert starts[0][0] < 0.01 < starts[0][1]


def test_the_first_screening_looks_across_a_kink() -> None:
    """A little of the effect makes the cloth fold the other way, which is worse; more of it is right."""
    tournament, starts = searching(lambda p: 1.1 if 0.35 < p[1] < 0.45 and p[0] == 0.5 else 3.0)
    tournament.run()
    assert starts[0] == pytest.approx(np.array([0.5, 0.4]))


def test_what_has_come_nearest_is_tried_first() -> None:
    reached, promised = {"hem": 3.0, "drag": 1.0, "lag": 2.0, "wind": 4.0}, {"hem": 2.0, "wind": 0.0, "drag": 1.0}
    assert _leaders(reached, promised, 1) == ["drag", "wind"]
    assert _leaders(reached, promised, 2) == ["drag", "lag", "wind"]


@pytest.mark.parametrize(("best", "gone_into"), [(1.5, ["drag", "wind", "lag"]), (3.0, ["drag", "wind", "lag", "hem"])])
def test_what_neither_comes_near_nor_promises_to_is_not_gone_into_beside_an_answer(
    best: float, gone_into: list[str]
) -> None:
    """The model without leaves six times the noise; wind promises three, lag has come to three, the hem to 5.5."""
    reached = {"drag": best * COUNT, "wind": 5.5 * COUNT, "lag": 3.0 * COUNT, "hem": 5.5 * COUNT}
    promise = {"drag": 2.0 * COUNT, "wind": 3.0 * COUNT, "lag": 5.9 * COUNT, "hem": 5.4 * COUNT}
    one = SimpleNamespace(plain=SimpleNamespace(rss=6.0 * COUNT, count=COUNT))
    found = {name: candidate(name, rss) for name, rss in reached.items()}
    assert _Tournament.in_reach(one, found, promise) == gone_into  # type: ignore[arg-type]


@pytest.mark.parametrize("promises", [True, False])
def test_nothing_is_spent_beside_an_answer_on_what_cannot_win(promises: bool) -> None:
    gone_into = []

    def roughly_polished(effects: tuple[str, ...], *_: object) -> Polished:
        gone_into.append(effects[0])
        return candidate(effects[0], COUNT if effects[0] == "drag" else 1.9 * COUNT).fit

    work, one = bench(lambda effects, *_: candidate(effects[0], COUNT).fit)
    work.roughly_polished = roughly_polished
    work.objective = lambda effects: SimpleNamespace(many=lambda points: [np.full(int(COUNT), 3.0) for _ in points])
    rss = {"drag": 1.1 * COUNT, "wind": (1.2 if promises else 1.9) * COUNT}
    looks = {n: replace(one.looks["drag"], name=n, space=candidate(n, COUNT).space, rss=rss[n]) for n in rss}
    _Tournament(work, (), one.plain, looks, {}).run()  # type: ignore[arg-type]
    assert set(gone_into) == ({"drag", "wind"} if promises else {"drag"})


@pytest.mark.parametrize(
    ("best", "behind", "refitted"), [(1.0, 1.8, ["drag"]), (1.0, 1.6, ["drag", "wind"]), (2.0, 2.0, ["drag"])]
)
def test_what_is_far_behind_is_not_refitted(best: float, behind: float, refitted: list[str]) -> None:
    """The plain model leaves twice the noise, drag one noise less; the other a fifth of that less, or two fifths."""
    asked = []

    def polished(effects: tuple[str, ...], unit: FloatArray, evaluations: int) -> Polished:
        asked.extend(effects)
        return candidate(effects[0], COUNT).fit

    left = {"drag": best * COUNT, "wind": behind * COUNT}
    work, one = bench(polished)
    work.roughly_polished = lambda effects, *_: candidate(effects[0], left[effects[0]]).fit
    work.objective = lambda effects: SimpleNamespace(many=lambda points: [np.full(int(COUNT), 3.0) for _ in points])
    looks = {n: replace(one.looks["drag"], name=n, space=candidate(n, COUNT).space, rss=left[n]) for n in left}
    found = _Tournament(work, (), one.plain, looks, {}).run()  # type: ignore[arg-type]
    assert asked == refitted and [c.name for c in found if c.refitted] == refitted


@pytest.mark.parametrize(
    ("reached", "promised", "asked"), [(2.0, 2.0, 12), (2.1, 2.05, 12), (2.1, 1.5, 40), (1.5, 1.5, 40)]
)
def test_the_model_as_it_is_gets_another_start_as_far_as_that_promises(
    reached: float, promised: float, asked: int
) -> None:
    plain, evaluations = candidate("x", 2.0 * COUNT).fit, []
    there = candidate("x", reached * COUNT).fit
    # what a linear model promises: so much along one direction goes away
    jacobian = np.zeros((len(there.white), 2))
    jacobian[: round(len(there.white) * (1.0 - promised / reached)), 0] = 1e3
    there = replace(there, jacobian=jacobian)

    def polished(effects: tuple[str, ...], unit: FloatArray, limit: int, *_: object) -> Polished:
        evaluations.append(limit)
        return there

    work = SimpleNamespace(polished=polished, roughly_polished=polished)
    found = from_there_too(work, (), plain, candidate("drag", COUNT))  # type: ignore[arg-type]
    assert evaluations[-1] == asked
    assert found.rss == pytest.approx(min(reached, 2.0) * COUNT)


@pytest.mark.parametrize(
    ("left", "rest", "cut_short", "said"),
    [
        (0.0, None, True, None),
        (9.0, None, False, "open"),
        (9.0, None, True, "unfinished"),
        (9.0, Decision("none", ()), False, "none"),
        (9.0, Decision("no-misfit", ()), True, None),
        (9.0, Decision("cannot-tell", (), unfinished=True), True, "unfinished"),
    ],
)
def test_what_stays_is_told_as_far_as_it_was_looked_into(
    left: float, rest: Decision | None, cut_short: bool, said: str | None
) -> None:
    joint, spent = SimpleNamespace(left=lambda _: left), SimpleNamespace(cut_short=cut_short)
    named = SimpleNamespace(verdict="named", further=(), after=None, rest=rest)
    assert _rest(named, joint, spent) == said  # type: ignore[arg-type]
    for other in ({"verdict": "none"}, {"further": ("wind", "drag")}):
        assert _rest(SimpleNamespace(**{**vars(named), **other}), joint, spent) is None  # type: ignore[arg-type]


def test_nothing_speaks_against_a_rival_that_is_tied() -> None:
    """It explains less than a name needs; told as its flaw, a second effect that decides would seem to have no say."""
    drag, damping = candidate("drag", 2.4 * COUNT), candidate("damping", 2.8 * COUNT)
    wind = candidate("wind", 4 * COUNT)
    e = evidence(9 * COUNT, drag, damping, wind)
    stage = Stage((), candidate("x", 9 * COUNT).fit, {}, e, decide(e))
    assert stage.decision == Decision("tied", ("drag", "damping"))
    assert [stage.objection(c) for c in (drag, damping, wind)] == [None, None, "little"]
