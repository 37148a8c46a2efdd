"""Of many recordings some are searched on, and what that leads to is kept if it is better on all."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from valleys import NAMES, SEEN, Valleys

from muslin.inference.criticism.work import Work
from muslin.inference.polish import polish
from muslin.inference.subset import on_all, on_some, some_of


@pytest.mark.parametrize(("fitted", "some"), [(19, []), (25, [0, 3, 5, 8, 11, 13, 16, 19, 21, 24])])
def test_many_recordings_are_searched_by_some_from_all_over(fitted: int, some: list[int]) -> None:
    names = [f"take {k}" for k in range(fitted)]
    assert some_of(names) == [names[k] for k in some]


def test_few_recordings_are_all_searched() -> None:
    few = Valleys(1.0, NAMES[:19])
    assert on_some(few) is few
    found = polish(few, np.array([0.75]))
    assert on_all(few, few, found) is found


def test_what_is_worse_on_all_recordings_than_where_the_search_began_is_left() -> None:
    objective = Valleys(9.0, NAMES)
    some = on_some(objective)
    better = polish(some, np.array([0.75]))
    assert better.unit[0] == pytest.approx(0.8, abs=0.01)
    found = on_all(objective, some, better, np.array([0.22]))
    assert found.unit[0] == pytest.approx(0.2, abs=0.01) and len(found.white) == SEEN * len(NAMES)


def diagnosing(elsewhere: float) -> tuple[SimpleNamespace, Valleys]:
    """The work of a diagnosis on these valleys."""
    objective = Valleys(elsewhere, NAMES)
    work = SimpleNamespace(objective=lambda effects: objective, limit=10**6, count=0, cut_short=False)
    work.problem = SimpleNamespace(fit_on=NAMES)
    for name in ("quick", "polished", "_affordable", "_again"):
        setattr(work, name, partial(getattr(Work, name), work))
    return work, objective


@pytest.mark.parametrize("start", [0.6, 0.78])
def test_a_candidate_is_led_there_by_some_recordings_and_fitted_to_all(start: float) -> None:
    work, objective = diagnosing(1.0)
    found = Work.searched(work, ("drag",), np.array([start]), 40)  # type: ignore[arg-type]
    assert found.unit[0] == pytest.approx(0.8, abs=1e-4) and found.rested
    assert len(found.white) == len(found.jacobian) == SEEN * len(NAMES) == found.count
    assert objective.evaluations <= 4  # there and where the search began, a derivative, a step
    np.testing.assert_allclose(found.covariance, polish(objective, np.array([start])).covariance, rtol=1e-6)


def test_nor_does_a_candidate_go_where_only_some_recordings_lead() -> None:
    work, _ = diagnosing(30.0)
    found = Work.searched(work, ("drag",), np.array([0.49]), 40)  # type: ignore[arg-type]
    assert found.unit[0] == pytest.approx(0.2, abs=1e-3)


def test_a_rough_search_on_some_says_what_it_leaves_of_all() -> None:
    work, objective = diagnosing(9.0)
    found = Work.roughly_searched(work, ("drag",), np.array([0.7]), 12)  # type: ignore[arg-type]
    assert found.unit[0] == pytest.approx(0.8, abs=0.01) and objective.evaluations == 1
    assert found.rss == pytest.approx(float(objective.one(found.unit) @ objective.one(found.unit)))
    assert found.count == SEEN * len(NAMES)
