"""How a diagnosis spends its simulations, and what it says of a misfit that stays."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_verdict import COUNT, candidate, evidence

from muslin.core.arrays import FloatArray
from muslin.inference.criticism import work
from muslin.inference.criticism.diagnose import _rest
from muslin.inference.criticism.stage import Stage, from_there_too
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
