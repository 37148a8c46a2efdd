"""The factory: options, refusals, and what it leaves behind."""

import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pybullet")

from pybullet_scenes import NOWHERE, SMALL_CLOTH, SMALL_ROPE, SMALL_SOLID, opened, scene

from muslin.backends.pybullet import PybulletSimulator, compiled, library
from muslin.core.body import Body, cloth_grid, solid_box
from muslin.core.errors import BrokenPluginError, InputError, RolloutFailed
from muslin.core.material import ClothMaterial, RopeMaterial, SolidMaterial
from muslin.core.obstacles import Table


def test_travels_and_names_its_engine():
    simulator = pickle.loads(pickle.dumps(PybulletSimulator(time_step=0.01)))
    assert (simulator.name, simulator.time_step) == ("pybullet", 0.01)
    assert simulator.engine_version().startswith("pybullet 3")


@pytest.mark.parametrize("options", [{"time_step": 0.0}, {"time_step": float("nan")}, {"most_substeps": 0}])
def test_refuses_impossible_options(options):
    with pytest.raises(InputError):
        PybulletSimulator(**options)


def test_time_step_is_the_worlds():
    with opened(scene(SMALL_CLOTH, ClothMaterial()), time_step=0.002) as world:
        assert world.time_step == 0.002


def test_too_stiff_for_its_mesh_is_a_failed_rollout():
    with pytest.raises(RolloutFailed, match="substeps"):
        PybulletSimulator(most_substeps=10).open(scene(SMALL_CLOTH, ClothMaterial(stretch_stiffness=3000.0)))


def test_a_state_that_is_not_finite_is_a_failed_rollout():
    with opened(scene(SMALL_CLOTH, ClothMaterial())) as world, pytest.raises(RolloutFailed, match="finite"):
        world.step(NOWHERE, np.full((25, 3), np.nan))


def test_refuses_empty_elements_and_more_than_two_triangles_at_an_edge():
    with pytest.raises(InputError, match="area"):
        PybulletSimulator().check(scene(Body("cloth", 0 * SMALL_CLOTH.vertices, SMALL_CLOTH.elements), ClothMaterial()))
    fin = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, -0.1, 0], [0, 0, 0.1]])
    body = Body("cloth", fin, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]]))
    with pytest.raises(InputError, match="3 triangles meet in the edge between vertices 0 and 1"):
        PybulletSimulator().check(scene(body, ClothMaterial()))


def test_missing_engine_is_explained(monkeypatch):
    monkeypatch.setattr(library.importlib.util, "find_spec", lambda name: None)
    library.bullet.cache_clear()
    try:
        with pytest.raises(BrokenPluginError, match=r"pip install muslin\[pybullet\]"):
            PybulletSimulator().open(scene(SMALL_CLOTH, ClothMaterial()))
    finally:
        library.bullet.cache_clear()


def test_missing_numba_is_explained(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    compiled._numba.cache_clear()
    try:
        with pytest.raises(BrokenPluginError, match=r"numba.*pip install muslin\[pybullet\]"):
            compiled.compiled(abs, "anything")
    finally:
        compiled._numba.cache_clear()


@pytest.mark.parametrize(
    ("body", "material"),
    [(SMALL_CLOTH, ClothMaterial(damping_time=1e-3)), (SMALL_SOLID, SolidMaterial()), (SMALL_ROPE, RopeMaterial())],
    ids=["cloth", "solid", "rope"],
)
def test_one_version_is_compiled_for_whatever_arrays_come(body, material):
    """Read-only or in Fortran's order: two versions in one file of the cache could be mixed up."""
    frozen = np.asfortranarray(body.vertices)
    elements = body.elements.copy()
    for array in (frozen, elements):
        array.flags.writeable = False
    for one in (body, Body(body.kind, frozen, elements, body.grid)):
        with opened(scene(one, material, held=np.array([0]), obstacles=(Table(-1.0),))) as world:
            world.step(np.asfortranarray(frozen[:1]), np.asfortranarray(np.zeros_like(frozen)))
            kernels = world._elasticity.kernels
    assert len(kernels.advance.signatures) == 1
    assert max(len(kernel.signatures) for kernel in kernels) == 1


def test_opening_often_leaks_nothing():
    scenes = [
        scene(cloth_grid(0.1, 0.1, 3, 3), ClothMaterial(), obstacles=(Table(-1.0),)),
        scene(solid_box(np.zeros(3), np.full(3, 0.03), (2, 2, 2)), SolidMaterial(), obstacles=(Table(-1.0),)),
    ]
    memory = []
    files, before = Path("/proc/self/fd"), set(os.listdir(tempfile.gettempdir()))
    handles = len(os.listdir(files)) if files.exists() else 0
    for k in range(40):
        for what in scenes:
            with opened(what) as world:
                world.step(NOWHERE, None)
        if k in (10, 39) and files.exists():
            memory.append(int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE"))
    if files.exists():
        assert len(os.listdir(files)) <= handles + 1
        assert memory[1] - memory[0] < 60e6
    left = set(os.listdir(tempfile.gettempdir())) - before
    assert not [name for name in left if name.startswith("muslin-") and name.endswith((".obj", ".vtk"))]


def test_is_silent_and_lazy():
    code = (
        "import sys, numpy as np; import muslin.backends.pybullet as b\n"
        "assert 'pybullet' not in sys.modules\n"
        "from muslin.core.body import solid_box; from muslin.core.material import SolidMaterial\n"
        "from muslin.core.scene import Scene; from muslin.core.obstacles import Table\n"
        "s = Scene(solid_box(np.zeros(3), np.ones(3), (2, 2, 2)), SolidMaterial(), np.zeros(3),"
        " (np.zeros(1, dtype=int),), np.zeros(8), (Table(-0.5),))\n"
        "w = b.PybulletSimulator().open(s); w.step(s.body.vertices[s.held], None); w.close()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd="/")
    assert (done.stdout, done.stderr) == ("", "")
