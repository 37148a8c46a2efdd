"""A rope that its gripper clamps is told from one that hangs in it as in a ring."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")

from muslin.backends.mujoco import MujocoSimulator
from muslin.cli import main
from muslin.cli.clamping import swing_near_the_gripper
from muslin.core.material import RopeMaterial
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.rollout import rollout
from muslin.core.scenarios import preset
from muslin.core.series import PointSeries
from muslin.core.study import read_config

TIME = np.linspace(0.0, 2.0, 121)
#: Every second vertex of a rope of 0.8 m, but those in the hand.
MARKERS = np.arange(2, 41, 4)
PLACES = 0.02 * MARKERS
SAID = "the gripper clamps the rope"


def recorded(
    grasp: list[int], rigidity: float, seed: int, sweep: float = 0.15, turn: float = 0.0, hertz: float = 0.8
) -> Recording:
    """A rope that is shaken, with 2 mm of noise and 3 % of the points not seen."""
    rng = np.random.default_rng(seed)
    ramp = np.clip((TIME - 0.2) / 0.3, 0.0, 1.0)
    poses = np.zeros((len(TIME), 1, 7))
    poses[:, 0, :3] = [0.3, 0.1, 1.2]
    poses[:, 0, 1] += sweep * ramp * np.sin(2 * np.pi * (hertz + 0.1 * seed) * (TIME - 0.2))
    angle = turn * ramp * np.sin(4.0 * (TIME - 0.2))
    poses[:, 0, 3], poses[:, 0, 4] = np.cos(angle / 2), np.sin(angle / 2)
    motion = Motion(TIME, poses)
    scenario = preset("swing").scenario(size=(0.8,), vertices=(41,))
    scenario = replace(scenario, motion=motion, times=TIME, grasps=(np.array(grasp),))
    material = RopeMaterial(0.05, 2000.0, rigidity, rigidity, damping_time=0.01)
    points = rollout(MujocoSimulator(time_step=0.0025), scenario, material).vertices[:, MARKERS]
    points = points + rng.normal(0.0, 0.002, points.shape)
    points[rng.random(points.shape[:2]) < 0.03] = np.nan
    return Recording(f"take{seed}", PointSeries(TIME, points), motion)


@pytest.mark.parametrize("rigidity", [1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("turn", [0.0, 0.5])
def test_near_a_clamp_a_rope_swings_less(rigidity: float, turn: float) -> None:
    """It follows a hand that turns, too; in a ring it is as good as straight near the hand. Of two takes."""
    takes = ([recorded(grasp, rigidity, k, turn=turn) for k in (0, 1)] for grasp in ([0, 1], [0]))
    clamp, ring = (swing_near_the_gripper(both, PLACES, 0.8) for both in takes)
    assert clamp is not None and ring is not None
    assert clamp < 0.75 and 0.9 < ring < 1.25


@pytest.mark.parametrize("late", [-0.05, -0.02, 0.02, 0.05])
def test_a_late_gripper_makes_no_clamp_of_a_ring(late: float) -> None:
    """Of one whose poses are off by 20 ms at most a clamp is still seen."""
    shares = []
    for grasp in ([0], [0, 1]):
        take = recorded(grasp, 1e-3, 1)
        assert take.gripper is not None
        take = replace(take, gripper=Motion(take.gripper.times - late, take.gripper.poses))
        shares.append(swing_near_the_gripper([take], PLACES, 0.8))
    ring, clamp = shares
    assert ring is not None and ring > 0.9
    assert abs(late) > 0.02 or (clamp is not None and clamp < 0.75)


def test_a_rope_that_its_own_inertia_bows_is_not_taken_for_a_clamped_one() -> None:
    """Shaken at 2 Hz a marker near a ring swings by less than a straight rope's would."""
    takes = [recorded([0], 1e-5, k, sweep=0.06, hertz=2.0) for k in (0, 1)]
    ring = swing_near_the_gripper(takes, PLACES, 0.8)
    assert ring is not None and ring > 0.9


def test_what_does_not_swing_or_has_no_marker_near_tells_nothing() -> None:
    still = recorded([0, 1], 1e-4, 0, sweep=0.0)
    assert swing_near_the_gripper([still], PLACES, 0.8) is None
    shaken = recorded([0, 1], 1e-4, 0)
    assert swing_near_the_gripper([shaken], PLACES + 0.3, 1.1) is None


@pytest.mark.parametrize("grasp, options", [([0], ()), ([0, 1], ()), ([0, 1], ("--grasp-points", "0,0,0"))])
def test_a_new_study_holds_a_rope_as_its_gripper_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], grasp: list[int], options: tuple[str, ...]
) -> None:
    """Unless the person says how it is held."""
    seen = len(grasp) == 2 and not options
    save_measurement(Measurement(tuple(recorded(grasp, 3e-4, k) for k in range(2))), tmp_path / "m.zarr")
    path = tmp_path / "s.toml"
    with pytest.raises(SystemExit) as caught:
        size = ("--size", "0.8") if options else ()
        main.run(["new", str(path), "--measurement", str(tmp_path / "m.zarr"), "--scenario", "swing", *size, *options])
    assert not caught.value.code
    assert (SAID in " ".join(capsys.readouterr().out.split())) == seen
    assert read_config(path).scenario.grasps == ([[0, 1]] if seen else None)
