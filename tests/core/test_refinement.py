"""A mesh of half the spacing is the same object."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.core.kept_bend import KeptBend
from muslin.core.material import RopeMaterial
from muslin.core.refinement import refined
from muslin.core.scenario import marker_weights
from muslin.core.scenarios import preset
from muslin.core.scenarios.kept import bent
from muslin.core.scenarios.starts import GivenShape


@pytest.mark.parametrize(("size", "counts"), [((0.3, 0.2), (5, 4)), ((0.8,), (9,))])
def test_size_mass_markers_and_threads_stay(size: tuple[float, ...], counts: tuple[int, ...]) -> None:
    coarse = preset("carry").scenario(size, counts)
    count = len(coarse.body.vertices)
    coarse = replace(coarse, markers=marker_weights(count, np.arange(count)[::2]))
    fine = refined(coarse)
    assert fine is not None
    assert len(fine.body.vertices) == count + len(coarse.body.edges)
    assert fine.body.measures.sum() == pytest.approx(coarse.body.measures.sum())
    assert fine.body.edge_lengths(fine.body.vertices).max() == pytest.approx(
        coarse.body.edge_lengths(coarse.body.vertices).max() / 2
    )
    np.testing.assert_allclose(fine.markers @ fine.body.vertices, coarse.markers @ coarse.body.vertices)
    if coarse.body.kind == "cloth":
        threads = np.repeat(coarse.body.warp_directions(coarse.body.vertices), 4, axis=0)
        np.testing.assert_allclose(fine.body.warp_directions(fine.body.vertices), threads, atol=1e-12)


def test_a_held_edge_stays_held_all_along() -> None:
    coarse = preset("carry").scenario((0.3, 0.2), (5, 4))
    fine = refined(coarse)
    assert fine is not None
    held = fine.body.vertices[fine.grasps[0]]
    top = fine.body.vertices[fine.body.vertices[:, 2] > fine.body.vertices[:, 2].max() - 1e-9]
    assert len(coarse.grasps[0]) == 5
    assert len(held) == len(top) == 9


def test_a_solid_is_not_refined() -> None:
    assert refined(preset("beam").scenario()) is None


def test_a_rope_with_a_shape_of_its_own_keeps_it() -> None:
    coarse = preset("cable").scenario((0.8,), (9,))
    bent = coarse.body.vertices + 0.02 * np.sin(np.arange(9))[:, None] * np.array([0.0, 1.0, 0.0])
    coarse = replace(coarse, start=GivenShape(bent, float(coarse.body.measures.sum()), bent[:2].mean(axis=0)))
    fine = refined(coarse)
    assert fine is not None
    start = fine.start_vertices()
    np.testing.assert_allclose(start[::2], coarse.start_vertices(), atol=1e-12)
    np.testing.assert_allclose(start[1::2], (start[:-1:2] + start[2::2]) / 2, atol=1e-12)


def test_a_bend_that_a_rope_keeps_is_the_same_on_the_finer_mesh() -> None:
    """But for what a mesh makes of it: nothing in the clamps, and as much in all along the rope."""
    coarse = preset("cable").scenario((0.8,), (21,))
    places = np.arange(1, 20)
    shape = np.stack([2.0 + np.sin(places / 5.0), 0.1 * places], axis=1)
    moments = np.random.default_rng(0).normal(size=(2, 4, 1, 2)) * np.linspace(0.0, 1.0, 19)[:, None]
    shapes = np.eye(19)[:, :, None] * shape
    coarse = replace(coarse, kept=KeptBend(shapes, 0.1 * shapes, moments, 0.2 * shape, places / 20, places / 20))
    fine = refined(coarse)
    assert fine is not None and fine.kept is not None
    assert [x.shape for x in (fine.kept.shapes, fine.kept.moments)] == [(19, 39, 2), (2, 4, 39, 2)]
    np.testing.assert_allclose(fine.kept.shapes.sum(axis=0)[3:-3:2], shape[1:-1])
    np.testing.assert_allclose(fine.kept.rates.sum(axis=0)[3:-3:2], 0.1 * shape[1:-1])
    np.testing.assert_allclose(fine.kept.torsion[3:-3:2], 0.2 * shape[1:-1])
    np.testing.assert_allclose(fine.kept.moments[..., 3:-3:2, :], moments[..., 1:-1, :])
    np.testing.assert_allclose(fine.kept.along, np.arange(1, 40) / 40)
    rope, gravity = RopeMaterial(end_bending_ratio=0.3, far_bending_ratio=2.0), np.zeros(3)
    uneven = [s.kept.curvature(rope, gravity) for s in (coarse, fine) if s.kept is not None]
    np.testing.assert_allclose(uneven[1][3:-3:2], uneven[0][1:-1])
    bends = [bent(s, s.kept.shapes.sum(axis=0)) for s in (coarse, fine) if s.kept is not None]
    np.testing.assert_allclose(bends[1].vertices[::2], bends[0].vertices, atol=5e-3)
    straight = np.diff(bends[1].vertices[:3], axis=0)
    np.testing.assert_allclose(np.cross(*straight), 0.0, atol=1e-12)
