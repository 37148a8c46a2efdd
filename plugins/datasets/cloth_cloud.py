"""Sheets lifted or folded by a robot, seen as point clouds."""

from collections.abc import Sequence
from pathlib import Path

from ...core.dataset import about, archives, arrays, chosen, note, shaped
from ...core.errors import InputError
from ...core.measurement import Recording
from ...core.motion import Motion
from ...core.series import PointSeries

#: Frames at the start in which the clouds hold arm and gripper rather than cloth.
SKIPPED = 5


def read_cloth_cloud(path: Path, takes: Sequence[str]) -> list[Recording]:
    """Takes from a folder of NPZ files, or one: ``points (T, P, 3)``, ``gripper_cmd (T, 3)`` [m], ``t (T,)`` [s].

    Clouds have no correspondence; they are cut off near the table and hold outliers. The gripper is the command, which
    the cloth's apex trails by 2 to 3 cm; its poses go from the first frame, the points from the sixth. Takes whose
    names differ in a trailing 2 alone are repeats.

    References:
        Sundaresan, Antonova and Bohg, *DiffCloud: real-to-sim from point clouds with differentiable simulation and
        rendering of deformable objects*, IROS 2022; github.com/priyasundaresan/diffcloud_real2sim.
    """
    files = archives(path, ("points", "gripper_cmd", "t"))
    made = []
    for name in chosen(takes, list(files), path):
        with about(files[name]):
            made.append(_recording(files[name], name))
    return made


def _recording(path: Path, name: str) -> Recording:
    data = arrays(path, ("points", "gripper_cmd", "t"))
    points = shaped(data["points"], (None, None, 3), "points", path)
    command = shaped(data["gripper_cmd"], (len(points), 3), "gripper_cmd", path)
    time = shaped(data["t"], (len(points),), "t", path)
    if len(points) < SKIPPED + 2:
        raise InputError(f"{path}: {len(points)} frames are too few; the first {SKIPPED} are left out")
    note(f"{name}: left out the first {SKIPPED} frames, which show arm and gripper")
    series = PointSeries(time[SKIPPED:], points[SKIPPED:], correspondence=False)
    return Recording(name, series, Motion.from_positions(time, command[:, None]), name.removesuffix("2"))
