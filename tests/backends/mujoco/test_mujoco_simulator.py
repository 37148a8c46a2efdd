"""The factory: options, refusals, failures with their reason, and what it leaves behind."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_scenes import DOWN, NOWHERE, SMALL_CLOTH, SMALL_SOLID, opened, run, scene

from muslin.backends.mujoco import MujocoSimulator
from muslin.core.body import Body
from muslin.core.errors import InputError, RolloutFailed
from muslin.core.material import ClothMaterial, SolidMaterial
from muslin.core.motion import Motion
from muslin.core.obstacles import Table
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario

OBJECTS = [
    pytest.param(SMALL_CLOTH, ClothMaterial(), id="cloth"),
    pytest.param(SMALL_SOLID, SolidMaterial(), id="solid"),
]


def test_travels_and_names_its_engine():
    simulator = pickle.loads(pickle.dumps(MujocoSimulator(time_step=0.01)))
    assert (simulator.name, simulator.time_step) == ("mujoco", 0.01)
    assert simulator.engine_version().startswith("mujoco 4")
    paths = [run(s.open(scene(SMALL_CLOTH, ClothMaterial())), 0.1) for s in (simulator, MujocoSimulator(0.01))]
    np.testing.assert_array_equal(*paths)


@pytest.mark.parametrize("time_step", [0.0, -0.001, 0.0501, float("nan"), float("inf")])
def test_refuses_an_impossible_time_step(time_step):
    with pytest.raises(InputError, match="time_step must be in"):
        MujocoSimulator(time_step=time_step)


def test_the_longest_time_step_is_allowed():
    with opened(scene(SMALL_CLOTH, ClothMaterial()), time_step=0.05) as world:
        run(world, 0.5)
        assert world.time_step == 0.05


@pytest.mark.parametrize(("body", "material"), OBJECTS)
def test_starts_at_rest_in_the_order_of_the_mesh(body, material):
    with opened(scene(body, material)) as world:
        np.testing.assert_array_equal(world.state().positions, body.vertices)
        np.testing.assert_array_equal(world.state().velocities, 0.0)


@pytest.mark.parametrize(("body", "material"), OBJECTS)
@pytest.mark.parametrize("loaded", [False, True])
def test_free_fall_is_that_of_the_theta_method(body, material, loaded):
    """g t (t + (2 theta - 1) h) / 2 in any direction, whatever hangs on the vertices."""
    gravity = np.array([1.0, -2.0, -9.0])
    loads = np.zeros(len(body.vertices))
    loads[-1] = 0.01 * loaded
    with opened(scene(body, material, gravity=gravity, loads=loads)) as world:
        fallen = run(world, 0.3) - body.vertices
        np.testing.assert_allclose(world.state().velocities, np.tile(0.3 * gravity, (len(loads), 1)), rtol=1e-8)
    np.testing.assert_allclose(
        fallen, np.tile(gravity * 0.15 * (0.3 + 0.005 * (2 / 1.9 - 1)), (len(loads), 1)), rtol=1e-8
    )


@pytest.mark.parametrize(("body", "material"), OBJECTS)
def test_a_force_gives_its_impulse_and_ends_with_its_step(body, material):
    """Momentum, which elasticity cannot change, loads included."""
    loads = np.zeros(len(body.vertices))
    loads[-1] = 0.02
    forces = np.zeros((len(loads), 3))
    forces[-1] = [0.02, 0.03, 0.01]
    with opened(scene(body, material, gravity=np.zeros(3), loads=loads)) as world:
        run(world, 0.2, forces=forces)
        np.testing.assert_allclose(world.masses @ world.state().velocities, 0.2 * forces[-1], rtol=1e-6)
        run(world, 0.2)
        np.testing.assert_allclose(world.masses @ world.state().velocities, 0.2 * forces[-1], rtol=1e-6)


@pytest.mark.parametrize(("body", "material"), OBJECTS)
def test_held_vertices_ignore_forces_and_pull_the_rest(body, material):
    held = np.array([0, 1])
    with opened(scene(body, material, held=held, gravity=np.zeros(3))) as world:
        for k in range(20):
            command = body.vertices[held] + np.array([0.0, 0.003 * (k + 1), 0.0])
            world.step(command, np.full((len(body.vertices), 3), 0.001))
            np.testing.assert_allclose(world.state().positions[held], command, rtol=0, atol=1e-15)
        np.testing.assert_allclose(world.state().velocities[held], [[0.0, 0.6, 0.0]] * 2, atol=1e-9)
        assert (world.state().positions - body.vertices)[:, 1].mean() > 0.01


def test_a_table_carries_a_sheet_and_friction_holds_it():
    flat = Body("cloth", SMALL_CLOTH.vertices[:, [0, 2, 1]] + [0.0, 0.0, 0.002], SMALL_CLOTH.elements)
    slides = []
    for friction in (0.0, 0.5):
        what = scene(
            flat, ClothMaterial(friction=friction), gravity=DOWN + np.array([2.0, 0.0, 0.0]), obstacles=(Table(0.0),)
        )
        with opened(what) as world:
            moved = run(world, 0.5) - flat.vertices
            slides.append(moved[:, 0].mean())
            assert np.abs(world.state().positions[:, 2]).max() < 0.003
    assert slides[0] == pytest.approx(0.5 * 2.0 * 0.5**2, rel=0.05)
    assert abs(slides[1]) < 0.2 * slides[0]


def test_a_warning_fails_the_rollout_with_mujocos_words():
    said = r"MuJoCo warned 0\.055 s after the start: Nan, Inf or huge value in QACC"
    with opened(scene(SMALL_CLOTH, ClothMaterial())) as world:
        for _ in range(10):
            world.step(NOWHERE, None)
        with pytest.raises(RolloutFailed, match=said):
            world.step(NOWHERE, np.full((16, 3), 1e12))


@pytest.mark.parametrize("vertex", [0, 5])
def test_a_force_that_is_not_finite_fails_the_rollout(vertex):
    """MuJoCo would leave out such steps without a warning, and the sheet would float."""
    forces = np.zeros((16, 3))
    forces[vertex, 1] = np.nan
    what = scene(SMALL_CLOTH, ClothMaterial(), held=np.array([0]))
    with opened(what) as world, pytest.raises(RolloutFailed, match="not finite"):
        world.step(SMALL_CLOTH.vertices[:1], forces)


def test_a_model_that_mujoco_refuses_fails_with_its_reason():
    """All vertices of the sheet in one place."""
    with pytest.raises(RolloutFailed, match="MuJoCo"):
        MujocoSimulator().open(scene(Body("cloth", 0 * SMALL_CLOTH.vertices, SMALL_CLOTH.elements), ClothMaterial()))


def test_an_overstretched_rollout_fails():
    """Two grippers tear the sheet apart."""
    times = np.array([0.0, 0.2])
    apart = np.zeros((2, 2, 3))
    apart[1, 1, 0] = 5.0
    task = Scenario(
        name="tear",
        body=SMALL_CLOTH,
        grasps=(np.array([0]), np.array([3])),
        motion=Motion.from_positions(times, apart),
        times=times,
        markers=np.eye(16),
        load_vertices=np.zeros(0, np.int64),
    )
    with pytest.raises(RolloutFailed, match="stretched"):
        rollout(MujocoSimulator(), task, ClothMaterial())


def test_is_silent_lazy_and_leaves_no_log(tmp_path):
    """Also when MuJoCo warns, which otherwise prints and drops a MUJOCO_LOG.TXT into the working folder."""
    code = (
        "import sys, numpy as np; import muslin.backends.mujoco as b\n"
        "assert 'mujoco' not in sys.modules\n"
        "from muslin.core.body import cloth_grid; from muslin.core.material import ClothMaterial\n"
        "from muslin.core.scene import Scene; from muslin.core.errors import RolloutFailed\n"
        "s = Scene(cloth_grid(1, 1, 3, 3), ClothMaterial(), np.zeros(3), (np.zeros(1, dtype=int),), np.zeros(9))\n"
        "w = b.MujocoSimulator().open(s); w.step(s.body.vertices[s.held], None)\n"
        "try:\n"
        "    w.step(s.body.vertices[s.held], np.full((9, 3), 1e12))\n"
        "except RolloutFailed: print('failed')\n"
        "w.close()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert (done.stdout, done.stderr) == ("failed\n", "")
    assert list(tmp_path.iterdir()) == []


def _resident() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs /proc")
def test_opening_often_leaks_nothing():
    memory = []
    for k in range(200):
        what = scene(SMALL_CLOTH, ClothMaterial()) if k % 2 else scene(SMALL_SOLID, SolidMaterial())
        with opened(what) as world:
            world.step(NOWHERE, None)
        if k in (49, 199):
            memory.append(_resident())
    assert memory[1] - memory[0] < 10e6


def test_worlds_live_side_by_side_and_repeat():
    with opened(scene(SMALL_CLOTH, ClothMaterial())) as one, opened(scene(SMALL_CLOTH, ClothMaterial())) as other:
        for _ in range(5):
            one.step(NOWHERE, None)
            other.step(NOWHERE, None)
        np.testing.assert_array_equal(one.state().positions, other.state().positions)
