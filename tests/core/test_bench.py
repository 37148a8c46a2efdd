"""The test bench: right simulators pass, wrong ones are shown as such, and nothing ends it."""

import json
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from bench_rod import RodSimulator

import muslin
from muslin.cli.main import run
from muslin.core.bench import GOALS, TESTS, Lab, Outcome, lines, run_bench
from muslin.core.bench.drape import shadow
from muslin.core.bench.lab import TooSlow, period
from muslin.core.bench.meshes import disc, strip
from muslin.core.body import rope_line
from muslin.core.errors import InputError, RolloutFailed
from muslin.core.material import RopeMaterial
from muslin.core.scene import Scene
from muslin.core.simulator import Simulator
from muslin.core.testing.reference import ReferenceSimulator

EASY = ("tensile-strip", "incline", "free-fall", "hanging-chain", "sag")


class Sheets(ReferenceSimulator):
    """The reference simulator without solids, which take it long."""

    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "rope"})


class Doubled(Sheets):
    """Makes everything twice as stiff to stretch as asked."""

    name: ClassVar[str] = "doubled"

    def open(self, scene):
        twice = replace(scene.material, stretch_stiffness=2 * scene.material.stretch_stiffness)
        return super().open(replace(scene, material=twice))


class Broken(Simulator):
    """Fails in every way."""

    name: ClassVar[str] = "broken"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"rope", "cloth"})

    def open(self, scene):
        if scene.body.kind == "rope":
            raise RolloutFailed("it blew up")
        raise ZeroDivisionError("a bug")

    def engine_version(self):
        return "none"


def hanging_rope(**changes):
    body = rope_line(np.array([[0.0, 0, 0], [0, 0, -0.3]]), 4)
    material = RopeMaterial(**changes)
    return Scene(body, material, np.array([0.0, 0.0, -9.81]), (np.array([0]),), np.zeros(4))


def outcome(delivered, asked=1.0, goal=0.05, meshes=(4, 8, 16), **changes):
    count = len(delivered)
    given = Outcome("t", "stretch", "cloth", "", "E t", "N/m", asked, goal, "", list(meshes[:count]), list(delivered))
    return replace(given, seconds=[0.1] * count, **changes)


@pytest.mark.slow
def test_the_reference_simulator_delivers_what_has_nothing_to_do_with_bending():
    report = run_bench(Sheets(), EASY)
    judged = [o for o in report.outcomes if o.claimed]
    assert {o.test for o in judged} == set(EASY)
    assert [o.label for o in judged if o.status != "met"] == []
    assert max(abs(o.error) for o in judged if o.group == "stretch") < 0.005
    assert max(abs(o.error) for o in judged if o.group == "sag") < 0.01
    assert max(abs(o.error) for o in judged if o.group == "period") < 0.005


@pytest.mark.slow
def test_doubled_stiffness_is_a_miss():
    report = run_bench(Doubled(), ["tensile-strip"])
    for o in report.outcomes:
        if o.delivered and o.quantity in ("E t", "EA"):
            assert o.status == "MISS"
            assert o.error == pytest.approx(1.0, abs=0.02)
    assert sum(o.status == "MISS" for o in report.outcomes) >= 5
    assert "1e+02 % worst" in report.summary
    assert any(line.endswith("MISS") and "+100" in line for line in lines(report))


@pytest.mark.slow
def test_a_known_good_rod_bends_as_asked_and_converges_with_the_square_of_the_cells():
    errors = {}
    for case in TESTS["cantilever"].cases(False):
        if case.kind == "rope":
            found = [case.measure(Lab(RodSimulator()), cells)[0] for cells in (6, 12)]
            errors[case.label] = [f / case.asked[0].value - 1 for f in found]
    assert len(errors) == 4
    for label, (coarse, fine) in errors.items():
        assert abs(fine) < 0.025, label
        assert 0.2 < fine / coarse < 0.3, label


def test_a_known_good_rod_vibrates_and_swings_as_asked():
    report = run_bench(RodSimulator(), ["vibration", "pendulum", "hanging-chain"])
    ropes = [o for o in report.outcomes if o.kind == "rope"]
    assert [o.status for o in ropes] == ["met"] * 3
    assert max(abs(o.error) for o in ropes) < 0.015
    assert {o.status for o in report.outcomes if o.kind != "rope"} == {"not claimed"}


def test_a_rod_twice_as_stiff_to_bend_is_a_miss():
    report = run_bench(RodSimulator(stiffer=2.0), ["cantilever", "vibration"])
    cantilever, vibration = [o for o in report.outcomes if o.kind == "rope"]
    assert cantilever.status == vibration.status == "MISS"
    assert cantilever.error == pytest.approx(1.0, abs=0.05)
    assert vibration.error == pytest.approx(1 / np.sqrt(2) - 1, abs=0.02)


def test_what_is_not_claimed_and_what_fails_is_told_and_does_not_end_the_bench():
    report = run_bench(Broken())
    assert {o.test for o in report.outcomes} == set(TESTS)
    by_kind = {k: {o.status for o in report.outcomes if o.kind == k} for k in ("rope", "cloth", "solid")}
    assert by_kind["solid"] == {"not claimed"}
    assert by_kind["rope"] == {"FAILED", "not claimed"}
    reasons = {o.test: o.reason for o in report.outcomes if o.kind == "rope"}
    assert "it blew up" in reasons["tensile-strip"]
    assert "torsion" in reasons["twist"]
    assert any("ZeroDivisionError: a bug" in line for line in lines(report))
    assert "FAILED" in report.summary
    json.dumps(report.to_json())


def test_an_unknown_test_is_named():
    with pytest.raises(InputError, match="Did you mean 'cantilever'"):
        run_bench(RodSimulator(), ["cantilevr"])


def test_every_quantity_with_a_goal_has_that_of_its_group():
    for test in TESTS.values():
        for quick in (True, False):
            cases = test.cases(quick)
            assert cases
            for case in cases:
                assert list(case.meshes) == sorted(set(case.meshes))
                for asked in case.asked:
                    if asked.value and test.name != "drape":
                        assert asked.goal == GOALS[test.group]


@pytest.mark.parametrize(
    ("delivered", "within", "settled", "status"),
    [
        ([1.2, 1.04, 1.01], 8, None, "met"),
        ([1.0, 1.2, 1.0], 16, None, "met"),
        ([1.0, 1.0, 1.2], None, None, "MISS"),
        ([1.2, 1.005, 1.0], 8, 8, "met"),
        ([2.0, 2.0, 2.0], None, 4, "MISS"),
        ([1.0], 4, None, "met"),
        ([], None, None, "FAILED"),
    ],
)
def test_when_a_mesh_counts_as_converged(delivered, within, settled, status):
    o = outcome(delivered)
    assert (o.within_from, o.settled_from, o.status) == (within, settled, status)


def test_where_zero_is_asked_the_goal_is_absolute():
    assert outcome([0.4, 0.2], asked=0.0, goal=0.3).within_from == 8
    assert outcome([0.4, -0.5], asked=0.0, goal=0.3).status == "MISS"


def test_where_nothing_is_asked_the_value_is_reported():
    o = outcome([0.5, 0.6], asked=None, goal=None)
    assert (o.status, o.error, o.within_from) == ("reported", None, None)


def test_settling_does_not_move_the_equilibrium():
    """A rope hangs longer by half its weight times its length over EA; lumped, exactly."""
    rest = Lab(RodSimulator()).settle(hanging_rope(stretch_stiffness=20.0, linear_density=0.5), 10.0, 1e-7)
    assert -rest[-1, 2] == pytest.approx(0.3 + 0.5 * 9.81 * 0.3**2 / 2 / 20.0, rel=1e-5)


def test_what_does_not_come_to_rest_fails():
    def restless(time, state, masses):
        return np.sin(40 * time) * masses[:, None] * np.array([5.0, 0, 0])

    with pytest.raises(RolloutFailed, match="did not come to rest"):
        Lab(RodSimulator()).settle(hanging_rope(), 100.0, 1e-6, restless)


def test_a_run_over_its_time_limit_fails():
    with pytest.raises(TooSlow, match="took longer than"):
        Lab(RodSimulator(), time_limit=0.0).settle(hanging_rope(), 10.0, 1e-6)


def test_the_period_of_a_sine():
    times = np.linspace(0.0, 2.0, 400)
    assert period(times, np.exp(-0.3 * times) * np.cos(2 * np.pi * times / 0.7)) == pytest.approx(0.7, rel=1e-3)
    with pytest.raises(RolloutFailed, match="no oscillation"):
        period(times, 1.0 + times)


@pytest.mark.parametrize("style", ["grid", "diagonal", "irregular"])
def test_strips_cover_their_area_and_have_a_row_to_hold(style):
    body = strip(-0.2, 0.4, 0.1, (12, 2), style)
    assert body.measures.min() > 0
    assert body.measures.sum() == pytest.approx(0.06)
    normals = np.cross(*np.moveaxis(body.vertices[body.elements[:, 1:]] - body.vertices[body.elements[:, :1]], 1, 0))
    assert (normals[:, 2] > 0).all()
    x = body.vertices[:, 0]
    assert [int((np.abs(x - at) < 1e-9).sum()) for at in (-0.2, 0.0, 0.4)] == [3, 3, 3]
    assert np.abs(body.warp_directions(body.vertices) - [1.0, 0.0, 0.0]).max() < 1e-12


def test_the_shadow_of_a_sheet():
    body = disc(0.15, 10)
    assert body.measures.sum() == pytest.approx(np.pi * 0.15**2, rel=0.01)
    assert shadow(body.vertices, body.triangles) == pytest.approx(body.measures.sum(), rel=0.01)
    folded = body.vertices * [1, 1, 0]
    folded[:, 0] = np.abs(folded[:, 0])  # one half upon the other
    assert shadow(folded, body.triangles) == pytest.approx(body.measures.sum() / 2, rel=0.05)


def test_the_command_prints_the_table_and_writes_the_file(tmp_path, capsys):
    muslin.register("simulator", "rod", RodSimulator)
    file = tmp_path / "rod.json"
    given = ["bench-material", "-s", "rod", "--test", "cantilever", "--json", str(file)]
    with pytest.raises(SystemExit) as done:
        run(given)
    assert done.value.code == 0
    told = capsys.readouterr().out
    assert "rod of the tests" in told
    assert "EI" in told
    assert " met" in told
    written = json.loads(file.read_text())
    assert written["simulator"] == "rod"
    assert [r["status"] for r in written["rows"] if r["kind"] == "rope"] == ["met"]
    with pytest.raises(SystemExit) as done:
        run(given)
    assert done.value.code == 2
    assert "exists already" in capsys.readouterr().err
