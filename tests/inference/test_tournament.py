"""Which candidates get simulations, and how many: screened, gone into, and the leaders fitted to the end."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_verdict import COUNT, candidate

from muslin.core.arrays import FloatArray
from muslin.inference.criticism.linear import Look
from muslin.inference.criticism.tournament import MORE_EVALUATIONS, Tournament, _leaders
from muslin.inference.criticism.work import Work
from muslin.inference.polish import Polished


def bench(polished: Callable[..., Polished]) -> tuple[SimpleNamespace, Tournament]:
    """Rollouts that run out, and a tournament of one candidate, whose fits are given."""
    drag = candidate("drag", 2 * COUNT)
    plain = Polished(np.array([0.5]), drag.fit.white, np.ones((len(drag.fit.white), 1)), np.eye(1), COUNT)
    start = np.array([0.5, 0.0])
    jacobian = np.tile([1.0, 0.5], (len(plain.white), 1))
    look = Look("drag", drag.space, start, plain.white, jacobian, start, plain.rss, 0.1, 1.0)
    config = SimpleNamespace(diagnose=SimpleNamespace(draws=4), study=SimpleNamespace(seed=1))
    work = SimpleNamespace(
        study=SimpleNamespace(config=config, progress=lambda *_: None), starts=np.full((2, 1), 0.5),
        count=0, limit=1000, cut_short=False, problem=SimpleNamespace(fit_on=["a"]),
        searched=polished, roughly_polished=polished,
    )  # fmt: skip
    work.may_go_on = lambda until=np.inf: Work.may_go_on(work, until)  # type: ignore[arg-type]
    return work, Tournament(work, (), plain, {"drag": look}, {})  # type: ignore[arg-type]


def searching(left: Callable[[FloatArray], float], reached: float = 1.0) -> tuple[Tournament, list[FloatArray]]:
    """A tournament in which every residual is ``left`` at a point, and the list of where its fits start.

    They all reach ``reached`` [what noise leaves].
    """
    starts: list[FloatArray] = []

    def polished(effects: tuple[str, ...], unit: FloatArray, *_: object) -> Polished:
        starts.append(unit)
        return candidate("drag", reached * COUNT).fit

    work, tournament = bench(polished)
    work.objective = lambda *_: SimpleNamespace(many=lambda points: [np.full(int(COUNT), left(p)) for p in points])
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
    work.objective = lambda *_: SimpleNamespace(many=lambda points: [np.full(int(COUNT), 3.0) for _ in points])
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
    work.objective = lambda *_: SimpleNamespace(many=lambda points: [np.full(int(COUNT), 3.0) for _ in points])
    work.count = work.limit if spent else 0
    said: list[str] = []
    work.study.progress = lambda title, *_: said.append(title)
    (found,) = tournament.run()
    assert found.tried is not spent
    done = ["screening drag", "trying drag", "looking closer at drag", "refitting drag"]
    assert said == ([] if spent else done)  # nor is it said to be


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
    found = Tournament.made_up(tournament, rows)  # type: ignore[arg-type]
    assert found == pytest.approx(np.array([0.6, 0.5, 0.6]), abs=1e-3)
    assert Tournament.made_up(tournament, rows[1:2]) is None  # type: ignore[arg-type]


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
    assert Tournament.in_reach(one, found, promise) == gone_into  # type: ignore[arg-type]


@pytest.mark.parametrize("promises", [True, False])
def test_nothing_is_spent_beside_an_answer_on_what_cannot_win(promises: bool) -> None:
    gone_into = []

    def roughly_polished(effects: tuple[str, ...], *_: object) -> Polished:
        gone_into.append(effects[0])
        return candidate(effects[0], COUNT if effects[0] == "drag" else 1.9 * COUNT).fit

    work, one = bench(lambda effects, *_: candidate(effects[0], COUNT).fit)
    work.roughly_polished = roughly_polished
    work.objective = lambda *_: SimpleNamespace(many=lambda points: [np.full(int(COUNT), 3.0) for _ in points])
    rss = {"drag": 1.1 * COUNT, "wind": (1.2 if promises else 1.9) * COUNT}
    looks = {n: replace(one.looks["drag"], name=n, space=candidate(n, COUNT).space, rss=rss[n]) for n in rss}
    Tournament(work, (), one.plain, looks, {}).run()  # type: ignore[arg-type]
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
    work.objective = lambda *_: SimpleNamespace(many=lambda points: [np.full(int(COUNT), 3.0) for _ in points])
    looks = {n: replace(one.looks["drag"], name=n, space=candidate(n, COUNT).space, rss=left[n]) for n in left}
    found = Tournament(work, (), one.plain, looks, {}).run()  # type: ignore[arg-type]
    assert asked == refitted and [c.name for c in found if c.refitted] == refitted


@pytest.mark.parametrize("elsewhere", [1.2, 4.5])
def test_who_leads_is_found_on_some_recordings_and_held_against_all(elsewhere: float) -> None:
    """On the half that is looked through drag leaves next to nothing; on the other less than the model, or more."""
    half = int(COUNT) // 2
    asked: list[int] = []

    def objective(effects: tuple[str, ...], recordings: Sequence[str] = ()) -> SimpleNamespace:
        def many(points: FloatArray) -> list[FloatArray]:
            asked.extend([half if recordings else 2 * half] * len(points))
            white = np.concatenate([np.full(half, 1.0), np.full(half, elsewhere)])
            return [white[: half if recordings else None] if p[1] else np.full(half, 3.0) for p in points]

        def part(found: Polished, some: SimpleNamespace) -> Polished:
            return replace(found, white=found.white[:half], jacobian=found.jacobian[:half], count=half)

        return SimpleNamespace(many=many, rows=lambda _: np.arange(2 * half) < half, part=part)

    def roughly_polished(
        effects: tuple[str, ...], unit: FloatArray, evaluations: int, known: None, recordings: Sequence[str]
    ) -> Polished:
        assert len(recordings) == 10
        (white,) = objective(effects, recordings).many(unit[None])
        return Polished(unit, white, np.zeros((half, 2)), np.eye(2), half)

    refitted = []

    def polished(effects: tuple[str, ...], unit: FloatArray, evaluations: int) -> Polished:
        refitted.append(unit)
        return candidate("drag", 1.0 * COUNT).fit

    work, tournament = bench(polished)
    tournament.plain = replace(tournament.plain, white=np.full(2 * half, 3.0))
    work.objective, work.roughly_polished = objective, roughly_polished
    work.problem.fit_on = [str(k) for k in range(20)]
    (found,) = tournament.run()
    assert asked.count(2 * half) == 1 and asked[-1] == 2 * half  # held against all once, in the end
    assert found.tried and len(found.fit.white) == 2 * half
    assert bool(refitted[0][1]) is (elsewhere < 4.0)  # what is worse on all is not gone on from


def test_what_acts_on_recordings_alone_that_are_not_searched_is_searched_on_all() -> None:
    half, asked = int(COUNT) // 2, list[int]()

    def objective(effects: tuple[str, ...], recordings: Sequence[str] = ()) -> SimpleNamespace:
        def many(points: FloatArray) -> list[FloatArray]:
            asked.extend([len(recordings)] * len(points))
            return [np.full(half if recordings else 2 * half, 3.0) for _ in points]

        def part(found: Polished, some: SimpleNamespace) -> Polished:
            return replace(found, white=found.white[:half], jacobian=found.jacobian[:half], count=half)

        return SimpleNamespace(many=many, rows=lambda _: np.arange(2 * half) < half, part=part)

    work, tournament = bench(lambda *_: candidate("drag", COUNT).fit)
    work.objective, work.problem.fit_on = objective, [str(k) for k in range(20)]
    tournament.looks["drag"].jacobian[:half, 1] = 0.0
    (found,) = tournament.run()
    assert found.tried and asked and not any(asked)
