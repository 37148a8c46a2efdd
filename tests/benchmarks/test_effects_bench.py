"""The benchmark of hidden effects: that its cases are fair, and are what they say."""

import itertools
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from effects import chosen
from effects_bench.baselines import Fitted
from effects_bench.cases import BLOCK, FIRST_SEEDS, SETTING_DECK, Case, plan
from effects_bench.generation import flaws, generate
from effects_bench.outside import LAWS, UNKNOWN, effect_class
from effects_bench.run import Run
from effects_bench.settings import SETTINGS
from effects_bench.strength import RANGES, solve

from muslin.core.errors import RolloutFailed
from muslin.core.registry import REGISTRY
from muslin.core.scenarios import preset
from muslin.inference.noise import Noise

CASE = Case(
    seed=7,
    kind="known",
    setting="rope-air",
    role="a",
    source="same",
    noise=0.002,
    correlated=False,
    dropouts=False,
    strength="strong",
    markers=None,
    offers=(("camera-offset",),),
)


def first(part: str, count: int) -> list[Case]:
    return list(itertools.islice(plan(FIRST_SEEDS[part]), count))


# --- cases ---------------------------------------------------------------------------------------------------------


def test_the_same_part_deals_the_same_cases() -> None:
    assert first("development", 70) == first("development", 70)


def test_development_and_test_seeds_stay_apart() -> None:
    seeds = {part: {c.seed for c in first(part, 3000)} for part in FIRST_SEEDS}
    assert not seeds["development"] & seeds["test"]


@pytest.mark.parametrize("part", FIRST_SEEDS)
def test_any_first_part_has_its_share_of_every_kind(part: str) -> None:
    cases, size = first(part, 200), sum(BLOCK.values())
    for upto in range(1, len(cases) + 1):
        count = Counter(c.kind for c in cases[:upto])
        for kind, share in BLOCK.items():
            assert abs(count[kind] - upto * share / size) <= 2.0
    assert BLOCK["none"] >= 0.3 * size
    assert BLOCK["unknown"] >= 0.2 * size


def test_every_kind_meets_every_setting_equally_often() -> None:
    count = Counter((c.kind, c.setting) for c in first("development", 20 * len(SETTING_DECK)))
    for kind, share in BLOCK.items():
        assert [count[kind, s] for s in SETTING_DECK] == [share * SETTING_DECK.count(s) for s in SETTING_DECK]


def test_every_built_in_effect_is_hidden_somewhere() -> None:
    effects = {n: REGISTRY.get("effect", n) for n in REGISTRY.names("effect")}
    # none of the ropes of the benchmark starts as it was measured
    own = {n: e for n, e in effects.items() if e.__module__.startswith("muslin.") and not e.needs_kept_bend}
    tried = {n for n, e in own.items() if e.candidate}
    assert tried <= {e for s in SETTINGS.values() for e in s.effects}


def test_no_effect_from_outside_is_a_candidate() -> None:
    assert not set(REGISTRY.names("effect")) & {*UNKNOWN, *LAWS}
    known = set(REGISTRY.names("effect"))
    assert all(set(accepted) <= known for _, accepted in LAWS.values())


def test_two_at_once_do_not_hang_on_one_that_cannot_show() -> None:
    for case in (c for c in first("development", 200) if c.kind == "two"):
        assert not set.intersection(*map(set, case.offers))
        assert all(a != b for a, b in case.offers)


@pytest.mark.parametrize("name", SETTINGS)
def test_a_finer_mesh_is_seen_and_held_at_the_same_places(name: str) -> None:
    setting = SETTINGS[name]
    for markers in (None, 5):
        coarse, fine = (setting.table(fine=f, markers=markers) for f in (False, True))
        bodies = [preset(setting.scenario).body(t.size, t.vertices).vertices for t in (coarse, fine)]
        assert isinstance(coarse.markers, list) and isinstance(fine.markers, list)
        assert np.allclose(bodies[0][coarse.markers], bodies[1][fine.markers])
        for held, finely in zip(coarse.grasps or [], fine.grasps or [], strict=True):
            assert np.allclose(np.ptp(bodies[0][held], axis=0), np.ptp(bodies[1][finely], axis=0))


@pytest.mark.parametrize("name", SETTINGS)
def test_a_held_out_motion_is_never_fitted(name: str) -> None:
    for fitted, held_out in SETTINGS[name].roles.values():
        assert held_out not in fitted
        assert {held_out, *fitted} <= set(SETTINGS[name].motions)


# --- generation ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_case_gives_the_same_numbers_again_and_shows_as_it_shall() -> None:
    one, two = generate(CASE), generate(CASE)
    assert one.truth == two.truth
    for a, b in zip(one.measurement.recordings, two.measurement.recordings, strict=True):
        assert np.array_equal(a.series.points, b.series.points)
    assert RANGES["strong"][0] <= one.truth.misfit["camera-offset"] <= RANGES["strong"][1]
    other = generate(replace(CASE, seed=8, kind="none", offers=()))
    assert other.truth.values != one.truth.values


def test_what_hides_nothing_differs_from_the_model_by_the_noise_alone() -> None:
    case = replace(CASE, kind="none", offers=(), noise=0.004)
    noisy, clean = (generate(replace(case, noise=n)).measurement.recordings for n in (0.004, 1e-9))
    apart = np.concatenate([(a.series.points - b.series.points).ravel() for a, b in zip(noisy, clean, strict=True)])
    assert np.std(apart) == pytest.approx(0.004, rel=0.05)


def test_noise_and_dropouts_are_as_the_case_says() -> None:
    case = replace(CASE, noise=0.002, correlated=True, dropouts=True)
    wild = flaws((4000, 20, 3), case, np.random.default_rng(0))
    lost = np.isnan(wild[..., 0])
    assert lost.mean() == pytest.approx(0.1, abs=0.01)
    assert np.nanstd(wild) == pytest.approx(0.002, rel=0.02)
    both = ~lost[1:] & ~lost[:-1]
    assert np.corrcoef(wild[1:][both].ravel(), wild[:-1][both].ravel())[0, 1] == pytest.approx(0.8, abs=0.01)
    white = flaws((2000, 20, 3), replace(case, correlated=False, dropouts=False), np.random.default_rng(0))
    assert abs(np.corrcoef(white[1:].ravel(), white[:-1].ravel())[0, 1]) < 0.02


def test_a_strength_is_found_where_the_misfit_grows_and_where_it_sets_in_at_once() -> None:
    assert solve(lambda s: 20 * s, 1.5, (1.4, 1.6))[0] == pytest.approx(0.075, rel=0.1)
    share, misfit = solve(lambda s: 0.01 if s < 0.2 else 400 * (s - 0.199), 5.0, (3.5, 8.0))
    assert 3.5 <= misfit <= 8.0 and share > 0.2
    assert solve(lambda s: 0.5 * s, 1.5, (0.9, 2.2)) == (1.0, 0.5)

    def breaks(share: float) -> float:
        if share > 0.2:
            raise RolloutFailed("too strong")
        return 10 * share

    assert 0.9 <= solve(breaks, 1.5, (0.9, 2.2))[1] <= 2.2


@pytest.mark.parametrize("name", [*UNKNOWN, *LAWS])
def test_an_effect_from_outside_moves_the_object_only_when_it_is_on(name: str) -> None:
    effect = effect_class(name)
    largest = {c.name: 0.5 * c.high for c in effect.coefficients}
    assert effect().is_off and not effect(**largest).is_off
    from muslin.backends.mujoco import MujocoSimulator
    from muslin.core.rollout import rollout

    scenario = preset("swing").scenario((0.4,), (6,))
    scenario = replace(scenario, times=np.arange(0.0, 0.6, 1 / 30))
    plain, off, on = (
        rollout(MujocoSimulator(), scenario, preset("swing").default_material("rope"), e).series.points
        for e in ([], [effect()], [effect(**largest)])
    )
    assert np.array_equal(plain, off)
    assert np.isfinite(on).all() and np.abs(on - plain).max() > 1e-5


def test_chosen_settings_and_kinds_keep_the_order_of_the_plan() -> None:
    some = chosen(FIRST_SEEDS["development"], 10, ["rope-air"], ["none", "known"])
    assert (
        some == [c for c in first("development", 400) if c.setting == "rope-air" and c.kind in ("none", "known")][:10]
    )


def test_a_case_by_itself_is_what_it_is_in_its_batch() -> None:
    batch = first("development", 9)
    start = FIRST_SEEDS["development"]
    assert chosen(start, 100, list(SETTINGS), list(BLOCK), [start + 8, start + 2]) == [batch[2], batch[8]]


# --- going on after a kill -----------------------------------------------------------------------------------------


def run(folder: Path, *baselines: str, made_of: str = "sources", draws: int = 1) -> Run:
    return Run(folder / "cells", folder / "draws", 1, baselines, draws, made_of, "baselines")


def test_a_stopped_run_goes_on_where_it_was(tmp_path: Path) -> None:
    one = run(tmp_path)
    assert one.record(CASE) is None
    one.kept.add({"failed": None, "seconds": 1.5}, "sources", CASE.as_dict())
    with (tmp_path / "cells").open("a", encoding="utf-8") as file:
        file.write('{"key": "abc", "rec')  # killed in the middle of a line
    assert run(tmp_path).record(CASE) == {"failed": None, "seconds": 1.5, "baselines": {}}
    assert run(tmp_path).record(replace(CASE, seed=8)) is None
    assert run(tmp_path, made_of="other sources").record(CASE) is None


def test_what_is_finished_is_told_though_the_time_is_up(tmp_path: Path) -> None:
    cases = [CASE, replace(CASE, seed=8), replace(CASE, seed=9)]
    run(tmp_path).kept.add({"seconds": 1.5}, "sources", cases[2].as_dict())
    told = list(run(tmp_path).finished(cases, 2, deadline=0.0))
    assert told == [(2, {"seconds": 1.5, "baselines": {}})]


@pytest.mark.slow
def test_baselines_are_asked_of_what_is_diagnosed_already_and_only_once(tmp_path: Path) -> None:
    case = replace(CASE, kind="none", offers=(), role="slow", markers=5)
    diagnosed = run(tmp_path)
    # what a diagnosis leaves for baselines
    fitted = Fitted(np.array([0.5, 0.5]), Noise(0.002, 0.0, "told", "m", 0.1), 1e-3)
    diagnosed.kept.add({"failed": None, "fitted": fitted.to_json()}, "sources", case.as_dict())
    asked = list(run(tmp_path, "residual-network").finished([case], 1, time.monotonic() + 600))
    assert [set(record["baselines"]) for _, record in asked] == [set(), {"residual-network"}]
    assert "failed" not in asked[-1][1]["baselines"]["residual-network"]
    again = list(run(tmp_path, "residual-network").finished([case], 1, time.monotonic() + 600))
    assert again == [asked[-1]]
    assert run(tmp_path, "residual-network", draws=2).record(case) == asked[0][1]
