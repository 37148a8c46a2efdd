"""The built-in scenarios, each by itself."""

import pickle

import numpy as np
import pytest

from muslin.core.body import cloth_grid
from muslin.core.errors import InputError
from muslin.core.material import UNITS, ClothMaterial
from muslin.core.rollout import rollout
from muslin.core.sanity import SanityCheck
from muslin.core.scenarios import PRESETS, preset
from muslin.core.testing.reference import ReferenceSimulator

DOWN = np.array([0.0, 0.0, -9.8])


def test_the_scenarios_that_are_promised() -> None:
    promised = {"wiping", "winding", "fling", "lift", "fold", "cable", "carry", "hang", "swing", "drop", "beam"}
    assert promised == set(PRESETS)


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_stands_on_its_own(name: str) -> None:
    base = preset(name)
    scenario = base.scenario()
    scene = scenario.scene(base.default_material(), DOWN)
    ReferenceSimulator().check(scene)
    start = scene.start_positions
    lengths = scene.body.edge_lengths(scene.body.vertices)
    np.testing.assert_allclose(scene.body.edge_lengths(start), lengths, rtol=1e-9)
    SanityCheck(scene)(start, 0.0)
    for obstacle in scenario.obstacles:
        assert obstacle.signed_distance(start)[0].min() > 0
    held = scenario.held_positions(np.zeros(1), start)
    np.testing.assert_allclose(held[0], start[scene.held], atol=1e-12)
    assert scene.body.kind == base.kind == base.default_material().kind
    assert len(pickle.loads(pickle.dumps(scenario)).start_vertices()) == len(start)
    assert {p.name for p in base.default_priors()} <= set(UNITS[base.kind])
    for p in base.default_priors():
        assert p.unit == UNITS[base.kind][p.name] and p.low < getattr(base.default_material(), p.name) < p.high


@pytest.mark.parametrize("name", [n for n, p in PRESETS.items() if len(p.motion().times) > 1])
def test_built_in_motions_start_and_end_gently(name: str) -> None:
    motion = preset(name).motion()
    speed = np.linalg.norm(np.diff(motion.poses[..., :3], axis=0), axis=2) / np.diff(motion.times)[:, None]
    assert speed[0].max() < 0.05 and speed.max() < 2.5
    np.testing.assert_allclose(np.linalg.norm(motion.poses[..., 3:], axis=2), 1.0, atol=1e-12)


@pytest.mark.parametrize("name", ["cable", "carry", "fold", "wiping"])
def test_a_small_one_can_be_simulated(name: str) -> None:
    base = preset(name)
    scenario = base.scenario(vertices=[9] if base.kind == "rope" else [4, 4])
    found = rollout(ReferenceSimulator(), scenario, base.default_material())
    assert np.isfinite(found.vertices).all()
    moved = np.linalg.norm(found.vertices[-1] - found.vertices[0], axis=1)
    assert moved.max() > 0.1


def test_fold_and_wiping_suit_the_size_of_the_cloth() -> None:
    for size in ([0.2, 0.3], [0.5, 0.6]):
        body = preset("fold").body(size)
        y = preset("fold").motion(body).poses[:, 0, 1]
        assert (y[0], y[-1]) == pytest.approx((0.0, -size[1]))
    assert preset("wiping").motion(preset("wiping").body([0.6, 0.6])).poses[-1, 0, 1] == pytest.approx(0.42)


def test_level_cloth_is_hanging_cloth_turned() -> None:
    level, upright = preset("fold").body((0.3, 0.2), (4, 3)), cloth_grid(0.3, 0.2, 4, 3)
    np.testing.assert_allclose(level.measures, upright.measures)
    assert not np.ptp(level.vertices[:, 2])
    np.testing.assert_allclose(np.abs(level.warp_directions(level.vertices)), np.tile([0, 1.0, 0], (12, 1)), atol=1e-12)


def test_winding_lays_the_rope_on_the_spool_without_pulling_it() -> None:
    """Between the last contact and the gripper there is just what is not on the spool yet."""
    base = preset("winding")
    motion, rope = base.motion(), base.body()
    q = motion.poses[:, 0, 3:]
    turned = 2 * np.unwrap(np.arctan2(q[:, 2], q[:, 0]))
    assert turned[-1] == pytest.approx(2.5 * np.pi)
    apart = (motion.poses[:, 0, :3] - base.obstacles[0].center)[:, [0, 2]]  # type: ignore[union-attr]
    free = np.sqrt((apart**2).sum(axis=1) - 0.044**2)
    np.testing.assert_allclose(free + 0.044 * turned, 0.5 * rope.measures.sum(), atol=1e-9)


def test_the_number_of_sizes_tells_the_kind() -> None:
    base = preset("swing")
    rope = base.body([0.8])
    assert (rope.kind, len(rope.vertices)) == ("rope", 41)
    np.testing.assert_allclose(rope.vertices[-1], [0, 0, -0.8])
    assert [g.tolist() for g in base.grasps(rope)] == [[0]]
    assert base.default_material("rope").kind == "rope"
    with pytest.raises(InputError, match=r"a cloth needs 2 positive sizes .* or a rope needs 1"):
        base.body([0.3, 0.3, 0.3])
    with pytest.raises(InputError, match="a rope needs 1 positive sizes"):
        preset("cable").body([0.3, 0.3])


def test_a_preset_may_have_a_material_of_its_own() -> None:
    thick = preset("wiping").default_material()
    assert isinstance(thick, ClothMaterial)
    assert (thick.areal_density, thick.bending_rigidity, thick.stretch_stiffness) == (0.5, 5e-4, 2000.0)
    assert preset("fling").default_material() == ClothMaterial()
    assert preset("wiping").default_material("solid").kind == "solid"


def test_unknown_scenario_names_the_nearest() -> None:
    with pytest.raises(InputError, match="Did you mean 'swing'"):
        preset("swnig")
    with pytest.raises(InputError, match="2 positive sizes"):
        preset("fling").body([0.3], [9, 9])
