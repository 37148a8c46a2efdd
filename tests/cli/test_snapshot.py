"""The object at its worst moment: what is drawn of it, and how far away its points are said to be."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from muslin.cli.report.figures_object import Snapshot, add_snapshots, camera, draw_snapshot, window
from muslin.cli.report.findings import Take
from muslin.cli.report.player import player_data

SQUARE = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.0, 0.1], [0.0, 0.0, 0.1]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
SHOT = Snapshot("a", SQUARE, SQUARE + np.array([0.0, 0.3, 0.4]), SQUARE, TRIANGLES)


def test_points_that_correspond_are_as_far_away_as_their_own() -> None:
    np.testing.assert_allclose(SHOT.distances(), 0.5)


def test_a_cloud_is_as_far_away_as_what_was_seen_of_it() -> None:
    """A camera that sees a corner says nothing about the rest, which a model that is right has, too."""
    seen = replace(SHOT, measured=np.array([[0.0, 0.01, 0.0], [np.nan] * 3]), correspondence=False)
    np.testing.assert_allclose(seen.distances(), 0.01)
    np.testing.assert_allclose(seen.errors(), 0.01)  # nor is the rest coloured as if it were wrong
    unseen = replace(seen, measured=np.full((2, 3), np.nan))
    assert not len(unseen.distances()) and np.isnan(unseen.errors()).all()


def test_a_model_is_coloured_by_what_was_seen_nearest_to_it() -> None:
    cloud = replace(SHOT, measured=np.array([[0.0, 0.01, 0.0], [0.1, 0.03, 0.1]]), correspondence=False)
    np.testing.assert_allclose(cloud.errors()[[0, 2]], [0.01, 0.03])
    np.testing.assert_allclose(cloud.vertex_errors()[[0, 2]], [0.01, 0.03], rtol=0.1)


def test_the_film_says_of_a_cloud_how_far_what_was_seen_is_from_the_object() -> None:
    frames = np.repeat(SQUARE[None], 20, axis=0)
    cloud = np.repeat(np.array([[[0.0, 0.003, 0.0], [0.0, 0.004, 0.0], [np.nan] * 3]]), 20, axis=0)
    take = Take(
        "lift", "fitted", {"worst_time": 0.0}, np.arange(20.0), np.zeros(20),
        measured=cloud, predicted=frames, vertices=frames, triangles=TRIANGLES, correspondence=False,
    )  # fmt: skip
    film = player_data(SimpleNamespace(takes=[take], after_label=""))  # type: ignore[arg-type]
    assert film is not None
    (model,) = json.loads(film["data"])["models"]
    np.testing.assert_allclose(model["rms"], np.sqrt(12.5), atol=0.006)  # [mm]


def test_what_is_far_higher_than_wide_gets_a_window_that_its_title_fits() -> None:
    view = camera(-0.5 * np.pi, 0.0)
    low, high = window([replace(SHOT, measured=SQUARE + np.array([0.0, 0.0, 10.0]))], view)
    assert high[0] - low[0] >= 0.5 * (high[1] - low[1])
    middle = 0.5 * (low + high)
    np.testing.assert_allclose(middle, [0.05, 5.05], atol=1e-9)


def test_what_is_too_small_to_see_is_drawn_as_points_too() -> None:
    axes = Figure().add_subplot()
    for speck, more in ((False, 0), (True, 1)):
        before = len(axes.collections)
        draw_snapshot(axes, SHOT, Normalize(0, 1), camera(-0.5 * np.pi, 0.0), speck)
        assert len(axes.collections) - before == 4 + more  # outlines, mesh, pairs, measured


def test_a_long_title_takes_lines_instead_of_running_into_the_scale() -> None:
    figure = Figure()
    shots = [replace(SHOT, title=title) for title in ("fitted model", "with viscous damping, grasp compliance, wind")]
    spots = list(figure.subplots(1, 2))
    add_snapshots(figure, spots, shots, SimpleNamespace(unit="m", noise=0.003))  # type: ignore[arg-type]
    short, long = (axes.get_title() for axes in spots)
    assert short == "fitted model: points 500 mm away"
    assert long == "with viscous damping, grasp compliance, wind:\npoints 500 mm away"
