"""``muslin render``: pictures of a simulated motion."""

import os
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ..core.arrays import FloatArray
from ..core.camera import Camera
from ..core.errors import InputError, MissingFileError, StepMissingError, UnknownPluginError
from ..core.material import with_fields
from ..core.picture import Appearance, Frame
from ..core.registry import REGISTRY
from ..core.renderer import Renderer, find_renderer
from ..core.rollout import rollout
from ..core.scenario import STANDARD_GRAVITY
from ..core.scenarios import PRESETS, preset
from ..core.scene import Scene
from ..core.store import new_folder, read
from ..core.study import Problem, Study
from .console import ProgressView, say
from .images import millimetres, read_image, write_image

_DOWN = np.array([0.0, 0.0, -STANDARD_GRAVITY])
_KINDS = ("rgb", "depth", "segmentation")


def add_to(app: typer.Typer) -> None:
    """Add the command of this file."""
    app.command("render")(render)


def render(
    what: Annotated[
        str, typer.Argument(metavar="SCENARIO|STUDY.toml", help=f"A study file, or one of {', '.join(PRESETS)}.")
    ],
    output: Annotated[Path, typer.Option("--out", "-o", metavar="FOLDER", help="The folder to write; must be new.")],
    simulator: Annotated[
        str, typer.Option(metavar="NAME", help="The engine that moves it; default mujoco, or that of the study.")
    ] = "",
    renderer: Annotated[
        str, typer.Option(metavar="NAME", help="What draws it: auto, or a name; muslin plugins lists them.")
    ] = "auto",
    camera: Annotated[
        Path | None,
        typer.Option(metavar="CAMERA.toml", help="A camera file, as every run writes one; default: sees all of it."),
    ] = None,
    texture: Annotated[Path | None, typer.Option(metavar="IMAGE", help="Laid over the object.")] = None,
    background: Annotated[Path | None, typer.Option(metavar="IMAGE", help="Behind everything.")] = None,
    fps: Annotated[
        float | None, typer.Option(metavar="RATE", help="Frames a second of the motion; default those of the data.")
    ] = None,
    recording: Annotated[
        str, typer.Option(metavar="NAME", help="Which recording of a study to simulate; default its first.")
    ] = "",
    force: Annotated[bool, typer.Option("--force", help="Replace a folder that this command wrote.")] = False,
) -> None:
    """Simulate a motion and draw it: colour, depth and segmentation, one PNG a frame.

    Depth is in millimetres, 0 where there is nothing. Segmentation is 0 background, 1 the object, 2 and up the
    obstacles in their order. Needs no display and no graphics card.
    """
    # everything that may be wrong with what was given is said before anything is simulated
    _check_folder(output, force)
    lens = Camera.load(camera) if camera is not None else None
    size = (lens.width, lens.height) if lens is not None else (Camera.width, Camera.height)
    look = Appearance()
    if texture is not None:
        look = replace(look, object=read_image(texture))
    if background is not None:
        look = replace(look, background=read_image(background, size))
    if fps is not None and not 0.1 <= fps <= 10_000:
        raise InputError(f"--fps must be 0.1 to 10000 frames a second, but is {fps:g}")
    drawer = find_renderer(renderer)
    with ProgressView() as progress:
        progress(f"simulating {what}", 0, 0)
        scene, times, vertices = _simulated(what, simulator, recording, fps)
        lens = lens or Camera.framing(vertices)
        with new_folder(output) as folder:
            for kind in _KINDS:
                (folder / kind).mkdir()
            began = time.perf_counter()
            for k, frame in enumerate(_frames(drawer, scene, vertices, lens, look)):
                _write(folder, k, frame)
                progress("drawing", k + 1, len(vertices))
            seconds = time.perf_counter() - began
            lens.save(folder / "camera.toml")
            np.savetxt(folder / "times.csv", times, fmt="%.6f", header="time [s]", comments="")
    say(
        f"wrote {output}: {len(vertices)} frames of {lens.width} x {lens.height}, drawn by {drawer.name!r} and written "
        f"at {len(vertices) / seconds:.0f} frames a second"
    )


def _frames(drawer: Renderer, scene: Scene, vertices: FloatArray, lens: Camera, look: Appearance) -> Iterator[Frame]:
    with drawer.open(scene, look) as view:
        for shape in vertices:
            yield view.render(shape, lens)


def _simulated(what: str, simulator: str, recording: str, fps: float | None) -> tuple[Scene, FloatArray, FloatArray]:
    """The scene, the times ``(T,)`` [s] and the vertices ``(T, V, 3)`` [m] of one rollout."""
    if what.endswith(".toml"):
        return _of_study(Path(what), simulator, recording, fps)
    if recording:
        raise InputError("--recording goes with a study; a built-in scenario has no recordings")
    base = preset(what)
    scenario, material = base.scenario(), base.default_material()
    scenario = replace(scenario, times=_resampled(scenario.times, fps))
    engine = REGISTRY.get("simulator", simulator or "mujoco")()
    trajectory = rollout(engine, scenario, material)
    return scenario.scene(material, _DOWN), scenario.times, trajectory.vertices


def _of_study(path: Path, simulator: str, recording: str, fps: float | None) -> tuple[Scene, FloatArray, FloatArray]:
    study = Study.load(path)
    problem = study.problem
    name = recording or problem.fit_on[0]
    if name not in problem.scenarios:
        raise UnknownPluginError(f"{path} has no recording {name!r}; it has {', '.join(problem.scenarios)}")
    scenario = problem.scenarios[name]
    scenario = replace(scenario, times=_resampled(scenario.times, fps))
    problem = replace(problem, scenarios={name: scenario})
    if simulator:
        problem = replace(problem, simulator=REGISTRY.get("simulator", simulator)())
    values = _estimate(study, problem)
    trajectory = problem.simulate(values, name)
    own = {k: v for k, v in values.items() if k != "scale" and "." not in k}
    scene = scenario.scene(with_fields(problem.material, own), _DOWN, values.get("scale", 1.0))
    return scene, scenario.times, trajectory.vertices


def _estimate(study: Study, problem: Problem) -> dict[str, float]:
    """What the study was fitted to; the middle of the prior where it has not been fitted."""
    try:
        return problem.space.as_dict(read(study.step_results("fit"), "estimate"))
    except StepMissingError:
        say(f"{study.path} has not been fitted, so every parameter has the middle of its prior")
        return problem.space.as_dict(problem.space.from_unit(np.full(len(problem.space), 0.5)))


def _resampled(times: FloatArray, fps: float | None) -> FloatArray:
    if fps is None:
        return times
    made = np.arange(times[0], times[-1] + 1e-9, 1.0 / fps)
    if len(made) < 2:
        raise InputError(f"--fps {fps:g} gives one frame of a motion of {times[-1] - times[0]:.3g} s; raise it")
    return made


def _write(folder: Path, number: int, frame: Frame) -> None:
    name = f"{number:05d}.png"
    write_image(folder / "rgb" / name, frame.rgb)
    write_image(folder / "depth" / name, millimetres(frame.depth))
    write_image(folder / "segmentation" / name, frame.segmentation)


def _check_folder(path: Path, force: bool) -> None:
    parent = path.absolute().parent
    if not parent.is_dir():
        raise MissingFileError(f"there is no folder {parent} for {path.name}; make it first")
    if not os.access(parent, os.W_OK):
        raise InputError(f"no permission to write in {parent}")
    if path.exists() and not force:
        raise InputError(f"{path} exists already; choose another name, or say --force to replace it")
    if path.exists() and not ((path / "camera.toml").is_file() and (path / "rgb").is_dir()):
        raise InputError(f"{path} exists and was not written by muslin render; it is not replaced")
