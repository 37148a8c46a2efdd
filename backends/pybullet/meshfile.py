"""Temporary mesh files: Bullet takes meshes only from disk."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from ...core.body import Body


@contextmanager
def mesh_file(body: Body) -> Iterator[str]:
    """Path of a file with the mesh, of a name never used before; removed on leaving.

    A cloth is written as Wavefront ``.obj`` and a solid as legacy ``.vtk``, the only format from which
    Bullet makes tetrahedra.
    """
    write, suffix = (_obj, ".obj") if body.kind == "cloth" else (_vtk, ".vtk")
    handle, path = tempfile.mkstemp(suffix=suffix, prefix="muslin-")
    try:
        with os.fdopen(handle, "w") as file:
            file.write(write(body))
        yield path
    finally:
        os.unlink(path)


def _obj(body: Body) -> str:
    points = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in body.vertices.tolist()]
    faces = [f"f {a} {b} {c}" for a, b, c in (body.elements + 1).tolist()]
    return "\n".join([*points, *faces]) + "\n"


def _vtk(body: Body) -> str:
    points = [f"{x:.17g} {y:.17g} {z:.17g}" for x, y, z in body.vertices.tolist()]
    cells = [f"4 {a} {b} {c} {d}" for a, b, c, d in body.elements.tolist()]
    lines = ["# vtk DataFile Version 2.0", "muslin", "ASCII", "DATASET UNSTRUCTURED_GRID"]
    lines += [f"POINTS {len(points)} double", *points]
    lines += [f"CELLS {len(cells)} {5 * len(cells)}", *cells]
    lines += [f"CELL_TYPES {len(cells)}", *["10"] * len(cells)]
    return "\n".join(lines) + "\n"
