"""Pairs of effects are found that neither one alone, nor derivatives at the fit without them, would tell of."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_verdict import candidate, evidence

from muslin.core.arrays import FloatArray
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.criticism.linear import Look, look_at
from muslin.inference.criticism.pairs import level_with_first, partners, promising_pairs
from muslin.inference.criticism.stage import Stage
from muslin.inference.criticism.verdict import Decision, decide
from muslin.inference.discrepancy import NONE
from muslin.inference.polish import Polished, polish

#: What each effect does to 400 residuals, in the order of the fits alone; slip does nothing below 0.2, and sway is much
#: like tilt.
EFFECTS = ("tilt", "slip", "wind", "lag", "sway")
PATTERNS = dict(zip(EFFECTS, np.linalg.qr(np.random.default_rng(3).normal(size=(400, 5)))[0].T * 60.0, strict=True))
PATTERNS["sway"] = 0.9 * PATTERNS["tilt"] + 0.4 * PATTERNS["sway"]
TRUTH = {"tilt": 0.7, "slip": 0.6}
NOISE = np.random.default_rng(4).normal(size=400)


def response(name: str, strength: float) -> FloatArray:
    return PATTERNS[name] * (max(0.0, strength - 0.2) if name == "slip" else strength)


class Model:
    """Residuals of a model with ``effects`` against a measurement with tilt and slip."""

    discrepancy, smooth = NONE, False

    def __init__(self, effects: tuple[str, ...]) -> None:
        self.effects = effects
        names = ["stiffness", *(f"{e}.strength" for e in effects)]
        self.space = ParameterSpace(tuple(Parameter(n, "1", 0, 1) for n in names))

    def one(self, unit: FloatArray) -> FloatArray:
        white = NOISE + np.full(400, 2.0) * (unit[0] - 0.5)
        white = white - sum(response(n, s) for n, s in TRUTH.items())
        return np.asarray(white + sum(response(n, s) for n, s in zip(self.effects, unit[1:], strict=True)))

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        return [self.one(u) for u in units]

    def jacobian(self, unit: FloatArray, white: FloatArray) -> FloatArray:
        return np.column_stack([(self.one(unit + 1e-4 * e) - white) / 1e-4 for e in np.eye(len(unit))])

    def count(self, white: FloatArray) -> float:
        return float(len(white))


class Bench:
    """Work whose rollouts are of :class:`Model`."""

    def __init__(self, most: float = np.inf) -> None:
        self.study = SimpleNamespace(progress=lambda *_: None)
        self.most, self.fits = most, list[tuple[str, ...]]()

    def may_go_on(self) -> bool:
        return len(self.fits) < self.most

    def space(self, effects: tuple[str, ...]) -> ParameterSpace:
        return Model(effects).space

    def quick(self, effects: tuple[str, ...]) -> Model:
        return Model(effects)

    def roughly_searched(self, effects: tuple[str, ...], start: FloatArray, evaluations: int) -> Polished:
        self.fits.append(effects)
        return polish(Model(effects), start, evaluations, roughly=True)  # type: ignore[arg-type]


@pytest.fixture
def stage() -> Stage:
    """Every candidate alone: tilt and slip explain something each, the others next to nothing."""
    plain = polish(Model(()), np.full(1, 0.3))  # type: ignore[arg-type]
    looks: dict[str, Look] = {n: look_at(n, Model((n,)), plain) for n in EFFECTS}  # type: ignore[arg-type]
    candidates = []
    for name in EFFECTS:
        fit = polish(Model((name,)), np.array([0.5, 0.5]))  # type: ignore[arg-type]
        candidates.append(replace(candidate(name, 1.0), space=Model((name,)).space, base=1, fit=fit))
    e = replace(evidence(plain.rss, *candidates), count=400.0)
    return Stage((), plain, looks, e, decide(e))


@pytest.fixture
def misfit(stage: Stage) -> Stage:
    """The same where so little of the residuals is noise that no pair leaves nothing else."""
    return replace(stage, evidence=replace(stage.evidence, count=200.0))


def test_the_pair_that_is_missing_comes_first(misfit: Stage) -> None:
    pairs = promising_pairs(Bench(), misfit)  # type: ignore[arg-type]
    assert set(pairs[0].names) == set(TRUTH)
    assert pairs[0].lead.rss == min(c.rss for c in misfit.evidence.candidates)
    assert pairs[0].values == pytest.approx({"stiffness": 0.5, "tilt.strength": 0.7, "slip.strength": 0.6}, abs=0.1)
    assert pairs[0].both.rss < 1.2 * pairs[0].both.fit.count < min(p.both.rss for p in pairs[1:])


def test_what_a_candidate_did_where_it_was_found_says_which_pair_to_try(misfit: Stage) -> None:
    """Tilt and sway explain most, but the same; derivatives at the model without it tell next to nothing of slip."""
    looks = misfit.looks | {"slip": replace(misfit.looks["slip"], jacobian=1e-3 * misfit.looks["slip"].jacobian)}
    alone = sorted(misfit.evidence.candidates, key=lambda c: c.rank)
    assert [c.name for c in alone[:2]] == ["tilt", "sway"]
    bench = Bench(most=1)
    promising_pairs(bench, replace(misfit, looks=looks))  # type: ignore[arg-type]
    assert bench.fits == [("tilt", "slip")]


def test_one_that_leaves_only_noise_ends_the_search(stage: Stage) -> None:
    (pair,) = promising_pairs(Bench(), stage)  # type: ignore[arg-type]
    assert set(pair.names) == set(TRUTH)
    for effect, more in (("tilt", False), ("wind", True)):  # pairs with what passes by itself are tried in any case
        passing = replace(stage, decision=Decision("named", (effect,)))
        assert (len(promising_pairs(Bench(), passing)) > 1) is more  # type: ignore[arg-type]


def test_no_pair_is_tried_twice_nor_beyond_the_budget(misfit: Stage) -> None:
    bench = Bench()
    pairs = promising_pairs(bench, misfit)  # type: ignore[arg-type]
    assert len({frozenset(p.names) for p in pairs}) == len(pairs) > 2
    few = Bench(most=2)
    assert len(promising_pairs(few, misfit)) == 2 == len(few.fits)  # type: ignore[arg-type]


def test_without_a_candidate_that_explains_anything_there_is_no_pair(stage: Stage) -> None:
    nothing = [replace(c, fit=replace(c.fit, white=stage.plain.white)) for c in stage.evidence.candidates]
    idle = replace(stage, evidence=replace(stage.evidence, candidates=tuple(nothing)))
    assert promising_pairs(Bench(), idle) == []  # type: ignore[arg-type]


def test_pairs_that_the_data_cannot_tell_are_told_of(misfit: Stage) -> None:
    first, far = (promising_pairs(Bench(), misfit)[k] for k in (0, -1))  # type: ignore[arg-type]
    near = replace(far, both=replace(first.both, name="wind"))
    assert level_with_first(misfit, [first, near, far]) == (first, near)
    assert level_with_first(misfit, []) == ()


def test_partners_are_those_that_promise_most_beside_the_lead(stage: Stage) -> None:
    assert "tilt" not in partners(stage, "tilt", 3)
    assert partners(stage, "slip", 1) == ["tilt"]
