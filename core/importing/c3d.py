"""Points from motion capture: C3D, through ezc3d.

ezc3d is C++ and takes its process down on some damaged files, so it reads in a process of its own.
"""

import importlib.util
import io
import subprocess
import sys
from pathlib import Path

import numpy as np

from ..errors import BrokenPluginError, InputError
from .raw import RawTake

_PATIENCE = 120.0  # [s]; a file of 100 MB takes a few


def read_c3d(path: Path) -> list[RawTake]:
    """One take: points in the order of the file's labels; a negative residual marks a gap.

    Raises:
        BrokenPluginError: ezc3d is not installed.
        InputError: not a C3D file, or a damaged one.
    """
    if importlib.util.find_spec("ezc3d") is None:
        raise BrokenPluginError(f"{path}: reading C3D needs ezc3d; install it with: pip install 'muslin[mocap]'")
    reader = Path(__file__).with_name("c3d_reader.py")
    # -P: the folder of the reader must not shadow modules that ezc3d imports
    command = [sys.executable, "-P", str(reader), str(path.resolve())]
    try:
        done = subprocess.run(command, capture_output=True, timeout=_PATIENCE, check=False)
    except subprocess.TimeoutExpired as error:
        raise InputError(f"{path} is damaged: reading it did not end in {_PATIENCE:.0f} s") from error
    if done.returncode != 0:
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        reason = (
            lines[-1].removesuffix(": iostream error")
            if lines and done.returncode > 0
            else "its header leads the reader astray"
        )
        raise InputError(f"{path} is damaged or not a C3D file: {reason:.200}")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as got:
        points, rate, declared = got["points"], float(got["rate"]), int(got["frames"])
        unit, labels = str(got["unit"]), [str(x) for x in got["labels"]]
    if points.shape[1] == 0 or len(labels) == 0:
        raise InputError(f"{path} holds no points; export the labelled markers")
    if len(points) < declared:
        raise InputError(f"{path} is cut short: it announces {declared} frames, but holds {len(points)}; copy it again")
    if not (np.isfinite(rate) and rate > 0):
        raise InputError(f"{path}: the frame rate is {rate:g} Hz; it must be positive")
    named = tuple(labels) if len(labels) == points.shape[1] else ()
    return [RawTake(np.arange(len(points)) / rate, points, unit=unit or None, labels=named)]
