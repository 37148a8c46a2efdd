"""Reads one C3D file with ezc3d and writes an NPZ to standard output. Run by :mod:`.c3d` as a script."""

import io
import os
import struct
import sys

import numpy as np


def _limit_memory(path: str) -> None:
    """A damaged header may announce any size; fail on it instead of filling the machine."""
    try:
        import resource
    except ImportError:  # not a POSIX system
        return
    limit = 4_000_000_000 + 40 * os.path.getsize(path)
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    if hard == resource.RLIM_INFINITY or limit < hard:
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))


def _announced_frames(path: str) -> int:
    """Frames that the file's header announces, modulo 65536; ezc3d tells only what it could read.

    The header counts from its fourth and fifth 16-bit words (first and last frame); the fourth byte of
    the parameter section says the byte order (86 is big-endian).
    """
    with open(path, "rb") as file:
        header = file.read(512)
        file.seek(512 * (header[0] - 1) + 3)
        order = ">" if file.read(1) == bytes([86]) else "<"
    first, last = struct.unpack(order + "2H", header[6:10])
    return int(last - first + 1) % 65536


def main(path: str) -> None:
    """Arrays ``points (T, P, 3)`` [unit of the file], ``rate`` [Hz], ``frames``, ``unit``, ``labels``."""
    output = os.dup(1)
    os.dup2(2, 1)  # whatever the library prints goes to standard error
    import ezc3d

    _limit_memory(path)
    file = ezc3d.c3d(path)
    parameters = file["parameters"]["POINT"]
    points = np.asarray(file["data"]["points"][:3], float).transpose(2, 1, 0)
    residuals = np.asarray(file["data"]["meta_points"]["residuals"], float)[0].T
    points[(residuals < 0) | ~np.isfinite(points).all(axis=2)] = np.nan
    units = parameters.get("UNITS", {}).get("value", [])
    labels = parameters.get("LABELS", {}).get("value", [])
    buffer = io.BytesIO()
    np.savez(
        buffer,
        points=points,
        rate=float(file["header"]["points"]["frame_rate"]),
        frames=_announced_frames(path),
        unit=str(units[0]) if len(units) else "",
        labels=np.array([str(x) for x in labels], dtype=np.str_),
    )
    with os.fdopen(output, "wb") as out:
        out.write(buffer.getvalue())


if __name__ == "__main__":
    try:
        main(sys.argv[1])
    except Exception as failure:  # one line for the parent process, whatever the library raised
        print(str(failure) or type(failure).__name__, file=sys.stderr)
        sys.exit(1)
