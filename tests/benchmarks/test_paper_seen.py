"""What the protocol of the paper measures with, against cases with known answers."""

from dataclasses import replace

import numpy as np
import pytest
from paper_scene import SETTINGS
from paper_seen import Detector, chamfer

from muslin.core.body import Body, rope_line
from muslin.core.camera import Camera
from muslin.core.keypoints import keypoint_weights
from muslin.core.material import RopeMaterial
from muslin.core.scene import Scene

#: From y = -1 m along y, x to the right.
CAMERA = Camera.look_at(np.array([0.0, -1.0, 0.0]), np.zeros(3))


def scene(body: Body) -> Scene:
    return Scene(body, RopeMaterial(), np.zeros(3), (), np.zeros(len(body.vertices)))


def square(left: int, top: int, side: int = 6) -> np.ndarray:
    mask = np.zeros((1, 40, 40), bool)
    mask[0, top : top + side, left : left + side] = True
    return mask


def test_the_distance_of_masks_is_chamfers() -> None:
    """A square moved by d < side has d columns at 1 to d pixels from the other; one in it, half of its rim's."""
    assert chamfer(square(5, 5), square(5, 5)) == 0.0
    assert chamfer(square(5, 5), square(7, 5)) == pytest.approx((1 + 2) / 6)
    assert chamfer(square(5, 5), square(6, 6, 4)) == pytest.approx(0.5 * (16 + 4 * np.sqrt(2)) / 36)
    assert chamfer(square(5, 5), np.zeros((1, 40, 40), bool)) == pytest.approx(np.hypot(40, 40))


@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize("count", [4, 8])
def test_keypoints_are_the_same_spots_on_every_mesh(name: str, count: int) -> None:
    bodies = [SETTINGS[name].scenario(reality).body for reality in ("same", "other")]
    one, other = (keypoint_weights(b, count) @ b.vertices for b in bodies)
    np.testing.assert_allclose(one, other, atol=1e-12)
    held = [SETTINGS[name].scenario(reality) for reality in ("same", "other")]
    spans = [np.ptp(s.body.vertices[s.grasps[0]], axis=0) for s in held]
    if name != "winding":  # two vertices of a rope, a clamp as long as a segment
        np.testing.assert_allclose(spans[0], spans[1], atol=1e-12)


def test_keypoints_come_with_noise_and_gaps_in_an_order_that_tells_nothing() -> None:
    rope = rope_line(np.array([[-0.3, 0.0, 0.0], [0.3, 0.0, 0.0]]), 13)
    still = np.repeat(rope.vertices[None], 4000, axis=0)
    found = Detector(scene(rope), CAMERA, 4)(still, np.random.default_rng(0))
    where = CAMERA.project(keypoint_weights(rope, 4) @ rope.vertices)[0]
    seen = np.isfinite(found).all(axis=2)
    assert seen.mean() == pytest.approx(0.95, abs=0.01)
    nearest = np.abs(found[..., None, 0] - where[:, 0]).argmin(axis=-1)
    for slot in range(4):
        share = np.bincount(nearest[seen[:, slot], slot], minlength=4) / seen[:, slot].sum()
        np.testing.assert_allclose(share, 0.25, atol=0.03)
    off = (found - where[nearest])[seen]
    np.testing.assert_allclose(off.std(axis=0), 2.0, rtol=0.03)
    np.testing.assert_allclose(off.mean(axis=0), 0.0, atol=0.1)
    in_metres = replace(Detector(scene(rope), CAMERA, 4), space="metres")(still, np.random.default_rng(0))
    assert in_metres.shape == (4000, 4, 3)
