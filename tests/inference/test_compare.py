"""Where a misfit sits, and whether it is one: what the parts of the comparison promise."""

import json
from dataclasses import replace

import numpy as np
import pytest
from linear_study import BODY, FRAMES, SD, SIDE, TIME, fitted, measured, scenario, swinging
from scipy import sparse, stats
from scipy.optimize import lsq_linear

from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.motion import Motion
from muslin.core.obstacles import Table
from muslin.core.rollout import Trajectory
from muslin.core.scenario import Scenario
from muslin.core.series import PointSeries
from muslin.inference.criticism.comparing import adequacy as adequacy_module
from muslin.inference.criticism.comparing.adequacy import Adequacy, adequacy
from muslin.inference.criticism.comparing.excess import excess, sentence
from muslin.inference.criticism.comparing.groups import partitions
from muslin.inference.criticism.comparing.parts import DISTANCES, PLACES, distance_labels, place_labels
from muslin.inference.criticism.comparing.phases import MOTION, contact_labels, motion_labels, motion_limits, speeds
from muslin.inference.criticism.comparing.replicates import NoiseDraws, Refit
from muslin.inference.criticism.comparing.result import Comparison, Row
from muslin.inference.criticism.comparing.sets import set_view
from muslin.inference.criticism.comparing.statistics import Statistic
from muslin.inference.criticism.comparing.views import two_views
from muslin.inference.noise import Noise
from muslin.inference.residuals import Offsets, residual

TRUTH, NONE = np.full(3, 0.5), Offsets()


def white_noise(ar1: float = 0.0, error: float = 0.02) -> Noise:
    return Noise(SD, ar1, "told", "m", error)


def around(body: Body, *grasp: int, **more: object) -> Scenario:
    motion, none = Motion.still(), np.zeros(0, np.int64)
    grasps = (np.array(grasp),) if grasp else ()
    made = Scenario("made up", body, grasps, motion, np.arange(3) * 0.1, np.eye(len(body.vertices)), none)
    return replace(made, **more)  # type: ignore[arg-type]


def names(labels: np.ndarray | None, of: tuple[str, ...]) -> list[str]:
    assert labels is not None
    return [of[k] for k in labels]


def test_a_sheet_has_corners_an_edge_and_a_middle_and_knows_what_is_held() -> None:
    made = around(cloth_grid(0.3, 0.3, 5, 5), 0, 4)
    found = np.array(names(place_labels(made), PLACES)).reshape(5, 5)
    assert found[0, 0] == found[0, 4] == "held corners" and found[4, 0] == found[4, 4] == "free corners"
    assert set(found[1:4, 1:4].ravel()) == {"middle"}
    assert set(found[4, 1:4]) == {"free edge"} and set(found[1, [0, 4]]) == {"held edge"}
    far = np.array(names(distance_labels(made), DISTANCES)).reshape(5, 5)
    assert far[0, 0] == "near the grasp" and far[4, 2] == "far from the grasp"


def test_parts_do_not_depend_on_the_order_of_vertices() -> None:
    body, order = cloth_grid(0.3, 0.2, 6, 5), np.random.default_rng(0).permutation(30)
    place = np.empty(30, np.int64)
    place[order] = np.arange(30)
    other = Body("cloth", body.vertices[order], place[body.elements])
    one, two = around(body, 2), around(other, int(place[2]))
    for labels in (place_labels, distance_labels):
        np.testing.assert_array_equal(np.asarray(labels(one))[order], labels(two))


def test_a_rope_has_ends_and_a_solid_has_corners_edges_and_faces() -> None:
    rope = around(rope_line(np.array([[0.0, 0, 0], [1.0, 0, 0]]), 11), 0)
    assert names(place_labels(rope), PLACES) == ["ends"] * 2 + ["middle"] * 7 + ["ends"] * 2
    assert names(distance_labels(rope), DISTANCES)[::5] == [
        "near the grasp",
        "halfway from the grasp",
        "far from the grasp",
    ]
    box = solid_box(np.zeros(3), np.ones(3), (5, 5, 5))
    found = np.array(names(place_labels(around(box)), PLACES)).reshape(5, 5, 5)
    assert found[0, 0, 0] == "free corners" and found[0, 0, 2] == "free edge" and found[0, 2, 2] == "faces"
    assert found[2, 2, 2] == "inside"
    assert distance_labels(around(box)) is None


def test_what_has_one_part_only_has_none() -> None:
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], float)
    closed = Body("cloth", corners, np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]))
    assert place_labels(around(closed)) is None


def moved(path: np.ndarray, made: Scenario) -> Trajectory:
    vertices = made.body.vertices + path[:, None]
    return Trajectory(PointSeries(made.times, vertices), vertices, np.zeros((len(path), 1, 7)))


def test_phases_follow_the_speed() -> None:
    times = np.arange(30) * 0.1
    made = around(BODY, 0, times=times)
    speed = np.repeat([0.0, 0.3, 2.0], 10)
    path = np.zeros((30, 3))
    path[:, 0] = np.concatenate([[0.0], np.cumsum(speed[1:] * 0.1)])
    trajectory = moved(path, made)
    labels = motion_labels(trajectory, made, motion_limits([speeds(trajectory, made)]))
    assert [MOTION[k] for k in labels[[4, 14, 25]]] == ["held still", "slow", "fast"]


def test_a_falling_object_flies_until_it_touches() -> None:
    times = np.arange(40) * 0.01
    made = around(BODY, times=times, obstacles=(Table(-0.6),))
    path = np.zeros((40, 3))
    path[:, 2] = np.maximum(-0.5 * 9.81 * times**2, -0.295)
    trajectory = moved(path, made)
    labels = motion_labels(trajectory, made, motion_limits([speeds(trajectory, made)]))
    touching = contact_labels(trajectory, made) == 0
    assert MOTION[labels[10]] == "free flight" and not touching[10].any()
    assert MOTION[labels[-1]] != "free flight" and touching[-1].any() and not touching[-1].all()


def test_a_refit_takes_out_what_least_squares_would_and_no_more_than_its_bounds_allow() -> None:
    rng = np.random.default_rng(0)
    jacobian, rows = rng.normal(size=(60, 3)), rng.normal(size=(5, 60))
    far = Refit(jacobian * 1e3, np.full(3, 0.5), np.zeros((60, 0)))(rows)
    exact = rows - (jacobian @ np.linalg.lstsq(jacobian, rows.T, rcond=None)[0]).T
    np.testing.assert_allclose(far, exact, atol=1e-9)
    unit = np.array([0.0, 0.02, 1.0])
    near = Refit(jacobian, unit, np.zeros((60, 0)))(rows)
    for row, left in zip(rows, near, strict=True):
        best = lsq_linear(jacobian, -row, (np.minimum(-unit, -1e-12), np.maximum(1 - unit, 1e-12))).x
        np.testing.assert_allclose(left, row + jacobian @ best, atol=1e-6)


def test_a_model_without_any_error_shows_no_sign_of_a_misfit() -> None:
    rows = sparse.csr_array(np.full((1, 4), 0.5))
    for relative, expected in ((True, 1.0), (False, 0.0)):
        of = Statistic("a sign", rows, relative).of(np.stack([np.zeros(4), np.ones(4)], axis=1))
        np.testing.assert_allclose(of, [expected, 4.0])


def test_replicated_noise_has_the_strength_and_the_colour_of_its_estimate() -> None:
    rng = np.random.default_rng(1)
    made = NoiseDraws(Noise(SD, 0.6, "told", "m", 0.0), 300, rng).at(np.zeros((40, 5, 3)), rng)
    assert abs(made.std() - 1.0) < 0.02
    assert abs(np.mean(made[:, 1:] * made[:, :-1]) - 0.6) < 0.02
    unsure = NoiseDraws(Noise(SD, 0.0, "told", "m", 0.2), 4000, rng)
    assert abs(unsure.scale.std() - 0.2) < 0.02


def p_of(points: np.ndarray, noise: Noise, offsets: Offsets, rng: np.random.Generator) -> Adequacy:
    takes, jacobian, unit = fitted(points, noise, offsets, TRUTH)
    return adequacy(takes, partitions(takes), jacobian, unit, noise, offsets, rng)


def test_the_p_value_is_uniform_where_the_model_is_right(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a linear model with AR(1) noise and a constant offset, both fitted."""
    monkeypatch.setattr(adequacy_module, "_MOST", 400)
    offsets, found = Offsets(0.0, 0.005), []
    for k in range(40):
        rng = np.random.default_rng([k, 1])
        points = measured(rng, 0.5) + rng.normal(size=3) * offsets.constant
        found.append(p_of(points, white_noise(0.5, 0.0), offsets, rng).p_value)
    assert stats.kstest(found, "uniform").pvalue > 0.01
    assert np.mean(np.array(found) < 0.1) < 0.25


def test_a_small_structured_misfit_is_seen_that_a_chi_square_test_misses(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wave of the lower half, one noise high."""
    monkeypatch.setattr(adequacy_module, "_MOST", 400)
    wave = np.sin(2 * np.pi * TIME)[:, None, None] * (BODY.vertices[:, 2] < -0.15)[:, None] * np.array([0.0, 1.0, 0.0])
    own, chi = [], []
    for k in range(8):
        rng = np.random.default_rng([k, 2])
        points = measured(rng) + 0.8 * SD * wave
        takes, _, _ = fitted(points, white_noise(), NONE, TRUTH)
        white, scale = takes[0].residual.white, 1 + 0.02 * rng.normal(size=4000)
        chi.append(float(np.mean(rng.chisquare(len(white) - 3, 4000) * scale**2 >= white @ white)))
        own.append(p_of(points, white_noise(), NONE, rng))
    assert np.median([a.p_value for a in own]) < 0.01 < 0.05 < np.median(chi)
    clearest = min(own, key=lambda a: a.p_value)
    assert "go together" in clearest.signs[0].name and "not adequate" in clearest.text()


def test_the_excess_is_placed_where_it_was_put() -> None:
    rng = np.random.default_rng(3)
    below = (BODY.vertices[:, 2] < -0.25)[:, None] * np.array([0.0, 0.02, 0.0])
    takes, _, _ = fitted(measured(rng) + below, white_noise(), NONE, TRUTH)
    base = replace(takes[0].best, series=PointSeries(TIME, swinging()))
    held = replace(takes[0], best=base, residual=residual(takes[0].recording, base.series, white_noise(), NONE))
    groups = excess([held], partitions([held]), white_noise(), rng)
    for title in ("phase", "distance", "place"):
        of = [g for g in groups if g.partition == title]
        assert abs(sum(g.share or 0.0 for g in of) - 1) < 1e-9 and abs(sum(g.portion for g in of) - 1) < 1e-9
    far = next(g for g in groups if g.name == "far from the grasp")
    assert far.share is not None and far.share > 0.9 and far.rmse > 4 * far.expected
    assert "far from the grasp" in sentence(groups, 1)


def test_no_excess_is_placed_where_there_is_none() -> None:
    takes, _, _ = fitted(measured(np.random.default_rng(4)), white_noise(), NONE, TRUTH)
    groups = excess(takes, partitions(takes), white_noise(), np.random.default_rng(0))
    assert all(g.share is None for g in groups) and "no larger than the noise may make it" in sentence(groups, 1)


def test_of_a_misfit_in_one_place_only_the_whole_is_told_as_noise() -> None:
    """One corner of sixteen is off by half more than the noise, which is little in all."""
    rng = np.random.default_rng(0)
    points = measured(rng)
    points[:, -1] += 1.4 * SD * rng.normal(size=points[:, -1].shape)
    takes, jacobian, unit = fitted(points, white_noise(), NONE, TRUTH)
    tested = adequacy(takes, partitions(takes), jacobian, unit, white_noise(), NONE, rng)
    assert "not adequate" in tested.text() and "free corners" in tested.text()
    told = sentence(excess(takes, partitions(takes), white_noise(), rng), 1)
    assert told == "As a whole the error is no larger than the noise may make it."


def unordered(points: np.ndarray, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.stack([frame[rng.permutation(len(frame))] for frame in points])


def loose(points: np.ndarray):  # type: ignore[no-untyped-def]
    """Held against the truth, without correspondence, of named markers."""
    held = fitted(swinging(), white_noise(), NONE, TRUTH)[0][0]
    recording = replace(held.recording, series=PointSeries(TIME, points, "m", False))
    made = replace(held.scenario, markers=np.eye(SIDE * SIDE) + 1e-9)
    best = Trajectory(PointSeries(TIME, swinging()), swinging(), np.zeros((FRAMES, 1, 7)))
    return replace(
        held,
        recording=recording,
        scenario=made,
        best=best,
        residual=residual(recording, best.series, white_noise(), NONE),
    )


def test_unordered_points_find_where_they_came_from() -> None:
    held = loose(unordered(measured(np.random.default_rng(5))))
    for t in range(FRAMES):
        assert len(np.unique(held.origin[t], axis=0)) == SIDE * SIDE
    noise = SD * np.random.default_rng(6).normal(size=(3, FRAMES, SIDE * SIDE, 3))
    assert (held.under_noise(30 * noise) ** 2).sum() < 0.9 * ((30 * noise) ** 2).sum()


def test_points_of_a_cloud_come_from_anywhere_on_the_surface() -> None:
    held = loose(swinging())
    middle = swinging()[:, BODY.triangles].mean(axis=2)
    cloud = replace(held.recording, series=PointSeries(TIME, middle, "m", False))
    on_mesh = replace(held, recording=cloud, scenario=scenario())
    assert np.abs(on_mesh.origin - middle).max() < 0.01
    assert np.abs(loose(swinging()).origin - swinging()).max() < 1e-12


def test_sets_do_not_depend_on_the_order_of_points() -> None:
    points, noise = measured(np.random.default_rng(7)), white_noise()
    one, two = (set_view(loose(unordered(points, s)), noise, np.random.default_rng(0)).mmd for s in (1, 2))
    np.testing.assert_allclose(one, two, rtol=1e-6)


def test_sets_under_noise_alone_are_alike_and_others_are_not() -> None:
    noise, found = white_noise(), []
    for k in range(6):
        held = loose(unordered(measured(np.random.default_rng([k, 3]))))
        found.append(set_view(held, noise, np.random.default_rng(k)).p_value)
    assert np.mean(np.array(found) < 0.1) < 0.5
    off = measured(np.random.default_rng(8))
    off[12:, BODY.vertices[:, 2] < -0.15] += [0.0, 0.05, 0.0]
    view = set_view(loose(unordered(off)), noise, np.random.default_rng(0))
    assert view.p_value < 0.01 and view.worst >= 12 and 0.3 < view.beyond < 0.7
    assert view.witness.max() > view.witness_limit.max() and view.witness.min() < -view.witness_limit.max()


def test_views_show_most_of_the_object() -> None:
    rng = np.random.default_rng(9)
    flat = rng.uniform(-1, 1, (4, 50, 3)) * [2.0, 0.01, 1.0]
    views = two_views(flat)
    assert views.shape == (2, 2, 3)
    np.testing.assert_allclose(views @ np.swapaxes(views, 1, 2), np.broadcast_to(np.eye(2), (2, 2, 2)), atol=1e-9)
    assert any(np.allclose(np.abs(v), [[1, 0, 0], [0, 0, 1]], atol=0.02) for v in views)
    np.testing.assert_array_equal(two_views(flat[..., :2]), np.eye(2)[None])


def test_a_comparison_is_plain_json() -> None:
    takes, jacobian, unit = fitted(measured(np.random.default_rng(10)), white_noise(), NONE, TRUTH)
    rng, by = np.random.default_rng(0), partitions(takes)
    tested = adequacy(takes, by, jacobian, unit, white_noise(), NONE, rng)
    row = Row("made up", "fit", SD, SD, 0.0, 0.1, 0.1, 0.2, 3, "m", 0.0, 0.0, 0.5, 0.1)
    groups = tuple(excess(takes, by, white_noise(), rng))
    comparison = Comparison((row,), tested, groups, sentence(groups, 1), "")
    told = json.loads(json.dumps(comparison.to_json()))
    assert told["adequate"] is comparison.adequate and told["rows"][0]["recording"] == "made up"
    assert comparison.text().splitlines()[-1] == tested.text()
