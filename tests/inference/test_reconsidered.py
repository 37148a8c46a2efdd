"""Held-out motions speak against a candidate by the numerics of the model where it fits, or not at all."""

from types import SimpleNamespace

import pytest
from test_verdict import COUNT, candidate, evidence

from muslin.inference.criticism.candidate import Candidate
from muslin.inference.criticism.reconsidered import reconsidered
from muslin.inference.criticism.stage import Stage
from muslin.inference.criticism.verdict import Decision, Evidence, decide
from muslin.inference.polish import Polished

#: Held out, the plain model is off by 10 mm; by the numerics of that model, both of these leave next to all of it.
LAG, LATENCY = candidate("lag", 1.0 * COUNT, held_out=0.0098), candidate("latency", 1.0 * COUNT + 5, held_out=0.0099)


class Bench:
    """Stands in for rollouts: where a candidate fits, it leaves so much on held-out motions [m]."""

    def __init__(self, **held_out: float) -> None:
        self.held_out, self.asked = held_out, list[str]()
        self.study = SimpleNamespace(progress=lambda *_: None)

    def where_it_fits(self, c: Candidate, plain: Polished) -> Evidence:
        self.asked.append(c.name)
        return evidence(plain.rss, candidate(c.name, c.rss, held_out=self.held_out[c.name]))


def stage(*candidates: Candidate) -> Stage:
    e = evidence(9 * COUNT, *candidates)
    return Stage((), candidate("x", 9 * COUNT).fit, {}, e, decide(e))


@pytest.mark.parametrize(
    "left, latency, decision",
    [
        (0.004, 0.0098, Decision("named", ("lag",))),
        (0.004, 0.004, Decision("tied", ("lag", "latency"))),
        (0.0098, 0.004, Decision("named", ("latency",))),
        (0.0098, 0.0098, Decision("none", ())),
    ],
)
def test_those_that_stand_where_they_fit_get_the_name(left: float, latency: float, decision: Decision) -> None:
    before = stage(LAG, LATENCY, candidate("wind", 5 * COUNT))
    assert before.decision == Decision("none", ())
    bench = Bench(lag=left, latency=latency)
    assert reconsidered(bench, before).decision == decision  # type: ignore[arg-type]
    assert bench.asked == ["lag", "latency"]


@pytest.mark.parametrize(
    "before",
    [
        stage(candidate("lag", 5 * COUNT, held_out=0.0098)),  # explains too little as well
        stage(candidate("lag", COUNT), candidate("latency", COUNT + 5, held_out=0.0098)),  # has its name
        stage(candidate("wind", 4 * COUNT), LATENCY, candidate("lag", 0.5 * COUNT, sd=1.0)),  # nearest: may be zero
    ],
)
def test_nothing_else_is_looked_at_again(before: Stage) -> None:
    bench = Bench()
    assert reconsidered(bench, before) is before and not bench.asked  # type: ignore[arg-type]
