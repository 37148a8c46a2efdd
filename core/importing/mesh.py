"""Objects and obstacles of the user's own: surfaces, tetrahedra and polylines from files.

Coordinates are taken as they are in the file, times a scale, z up unless said otherwise.
"""

import importlib
import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ..arrays import FloatArray, IntArray
from ..body import Body, rope_line
from ..errors import BrokenPluginError, InputError, MissingFileError
from .axes import turned
from .table import read_table

SURFACES = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf")
TETRAHEDRA = (".vtk", ".vtu", ".msh")
#: An object larger or smaller than this is given in another unit than metres [m].
LARGEST, SMALLEST = 20.0, 0.005
#: Vertices nearer to each other than this share of the mesh's size are one.
SAME = 1e-6


def read_body(path: Path, scale: float = 1.0, up: str = "z", count: int | None = None) -> Body:
    """An object from a file, by its ending.

    A triangle mesh (``.obj``, ``.ply``, ``.stl``, ``.off``, ``.glb``) is cloth, with any holes and seams; its
    vertices keep the order of the file, but those at one place are merged (renderers cut meshes along seams
    of the texture) and count once, at the first; triangles are turned to look to the side that the first one of
    their piece looks to. Many exporters have y up, glTF always. A tetrahedral mesh
    (``.vtk``, ``.vtu``, ``.msh``) is a solid. A ``.csv`` with the columns x, y, z is a rope: a polyline, cut
    anew into segments of equal length.

    Args:
        path: of the file.
        scale: of the coordinates, 0.001 for a file in millimetres [1].
        up: axis of the file that is turned to z; x, y, z become those that follow it.
        count: vertices of a rope; default as many as the polyline has points.

    Raises:
        MissingFileError: there is no such file.
        BrokenPluginError: the reader of this format is not installed.
        InputError: not such a file, or a mesh that no object can have; says where.
    """
    if not path.is_file():
        raise MissingFileError(f"there is no mesh {path}; paths in a study start at the study file")
    ending = path.suffix.lower()
    if count is not None and ending in (*SURFACES, *TETRAHEDRA):
        raise InputError(f"{path}: vertices = [{count}] is for ropes; this mesh has vertices of its own")
    if ending in SURFACES:
        vertices, triangles = _surface(path, scale, up)
        body = Body("cloth", vertices, _looking_alike(triangles))
    elif ending in TETRAHEDRA:
        body = _solid(path, scale, up)
    elif ending == ".csv":
        body = _rope(path, scale, up, count)
    else:
        raise InputError(
            f"{path}: no reader for {ending or 'a file without ending'}; cloth: {', '.join(SURFACES)}; solid: "
            f"{', '.join(TETRAHEDRA)}; rope: .csv with columns x, y, z"
        )
    size = float(np.ptp(body.vertices, axis=0).max())
    if not SMALLEST <= size <= LARGEST:
        hint = (
            "is the file in millimetres (mesh_scale = 0.001) or centimetres (0.01)?"
            if size > LARGEST or scale >= 1.0
            else "is the file in metres already (mesh_scale = 1)?"
        )
        raise InputError(f"{path}: the object is {size:.4g} m large with mesh_scale = {scale:g}; {hint}")
    return body


def read_closed_surface(path: Path, scale: float = 1.0, up: str = "z") -> tuple[FloatArray, IntArray]:
    """Vertices ``(N, 3)`` [m] and outward triangles ``(F, 3)`` of a closed mesh.

    Raises:
        MissingFileError: there is no such file.
        BrokenPluginError: trimesh is not installed.
        InputError: see :func:`read_body`; also triangles that do not look to the same side.
    """
    if not path.is_file():
        raise MissingFileError(f"there is no mesh {path}; paths in a study start at the study file")
    vertices, triangles = _surface(path, scale, up)
    halves = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    _, first, uses = np.unique(halves, axis=0, return_index=True, return_counts=True)
    if (uses > 1).any():
        k = int(first[np.argmax(uses)] // 3)
        raise InputError(
            f"{path}: the triangles do not all look to the same side, as triangle {k} at "
            f"{_place(vertices[triangles[k]].mean(axis=0))}; recalculate the normals to point outside"
        )
    if np.linalg.det(vertices[triangles]).sum() < 0:
        triangles = triangles[:, ::-1]
    return vertices, triangles


def _surface(path: Path, scale: float, up: str) -> tuple[FloatArray, IntArray]:
    trimesh = _library("trimesh", path)
    mesh = _read(path, lambda: trimesh.load(path, force="mesh", process=False, maintain_order=True))
    vertices, triangles = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64).reshape(-1, 3)
    _must_be_usable(path, vertices, triangles, "triangles")
    if path.suffix.lower() == ".obj":  # trimesh leaves loose vertices of these out, which shifts the numbers
        named = sum(line.startswith(("v ", "v\t")) for line in path.read_text(errors="replace").splitlines())
        if named > len(vertices):
            raise InputError(f"{path}: {named - len(vertices)} vertices belong to nothing; {_LOOSE}")
    vertices, triangles = _merged(turned(vertices, up, str(path)) * scale, triangles)
    _must_be_clean(path, vertices, triangles)
    return vertices, triangles


def _looking_alike(triangles: IntArray) -> IntArray:
    """The same ``(F, 3)``, all of a piece turned to the side of its first one, as bends of a sheet have a sign.

    Of a surface with one side only, as a Moebius strip, some remain the wrong way round where it closes.
    """
    sides = triangles[:, [[0, 1], [1, 2], [2, 0]]]
    beside = dict[tuple[int, int], list[tuple[int, bool]]]()
    for f, its in enumerate(sides.tolist()):
        for a, b in its:
            beside.setdefault((min(a, b), max(a, b)), []).append((f, a < b))
    turn = np.full(len(triangles), -1)
    for first in range(len(triangles)):
        if turn[first] >= 0:
            continue
        turn[first], reached = 0, [first]
        while reached:
            f = reached.pop()
            for a, b in sides[f].tolist():
                for other, upward in beside[min(a, b), max(a, b)]:
                    if turn[other] < 0:  # two that look alike go along their edge in opposite ways
                        turn[other] = turn[f] ^ (upward == (a < b))
                        reached.append(other)
    return np.where(turn[:, None] == 1, triangles[:, [0, 2, 1]], triangles)


def _solid(path: Path, scale: float, up: str) -> Body:
    # the readers themselves: meshio.read ends the process on some files that it cannot read
    modules = {".vtk": "meshio.vtk", ".vtu": "meshio.vtu", ".msh": "meshio.gmsh"}
    reader = _library(modules[path.suffix.lower()], path)
    mesh = _read(path, lambda: reader.read(str(path)))
    blocks = [np.asarray(c.data, np.int64) for c in mesh.cells if c.type == "tetra"]
    if not blocks:
        found = ", ".join(sorted({str(c.type) for c in mesh.cells})) or "nothing"
        raise InputError(f"{path} holds no linear tetrahedra but {found}; mesh its volume with 4-node tetrahedra")
    tetrahedra = np.concatenate(blocks)
    vertices = turned(np.asarray(mesh.points, float)[:, :3], up, str(path)) * scale
    _must_be_usable(path, vertices, tetrahedra, "tetrahedra")
    edges = vertices[tetrahedra[:, 1:]] - vertices[tetrahedra[:, :1]]
    volume = np.linalg.det(edges)
    flat = np.abs(volume) < 1e-6 * np.linalg.norm(edges, axis=2).max(axis=1) ** 3
    if flat.any():
        k = int(np.argmax(flat))
        raise InputError(f"{path}: tetrahedron {k} at {_place(vertices[tetrahedra[k]].mean(axis=0))} has no volume")
    turn = volume < 0
    tetrahedra[turn, 1], tetrahedra[turn, 2] = tetrahedra[turn, 2], tetrahedra[turn, 1].copy()
    _must_be_used(path, vertices, tetrahedra)
    return Body("solid", vertices, tetrahedra)


def _rope(path: Path, scale: float, up: str, count: int | None) -> Body:
    table = read_table(path, ("x", "y", "z"), ())
    points = np.array([[table.number(row, axis) for axis in ("x", "y", "z")] for row in table.rows])
    try:
        return rope_line(turned(points, up, str(path)) * scale, len(points) if count is None else count)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _library(module: str, path: Path) -> ModuleType:
    name = module.split(".")[0]
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise BrokenPluginError(
            f"{path}: reading {path.suffix.lower()} needs {name}; install it with: pip install 'muslin[mesh]'"
        ) from error


def _read(path: Path, reader: Callable[[], Any]) -> Any:
    """Whatever a reader raises on a damaged file, in one line; what it warns of does not matter here."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return reader()
    except ImportError as error:  # a reader guesses at the encoding of what is no text, with what is not installed
        raise InputError(f"{path} is damaged or not a {path.suffix.lower()} file") from error
    except Exception as error:
        reason = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise InputError(f"{path} is damaged or not a {path.suffix.lower()} file: {reason:.200}") from error


def _merged(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """Vertices at one place made one, the first of them, in the order of the file."""
    size = float(np.ptp(vertices, axis=0).max())
    cells = np.rint(vertices / (SAME * size if size > 0 else 1.0)).astype(np.int64)
    _, first, which = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return vertices[first[order]], rank[which.ravel()][triangles]


_LOOSE = "delete loose vertices (in Blender: Mesh, Clean Up, Delete Loose)"


def _must_be_usable(path: Path, vertices: FloatArray, elements: IntArray, what: str) -> None:
    if not len(elements):
        raise InputError(f"{path} holds no {what}; is it a point cloud, or an empty export?")
    if not np.isfinite(vertices).all():
        k = int(np.argmin(np.isfinite(vertices).all(axis=1)))
        raise InputError(f"{path}: vertex {k} is not finite: {vertices[k].tolist()}")
    if elements.min() < 0 or elements.max() >= len(vertices):
        raise InputError(f"{path}: it has {len(vertices)} vertices, but its {what} name vertex {elements.max()}")


def _must_be_clean(path: Path, vertices: FloatArray, triangles: IntArray) -> None:
    """What no cloth can be made of; places are those of the mesh to scale, z up."""
    p = vertices[triangles]
    edges = p - np.roll(p, 1, axis=1)
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    thin = area <= 1e-6 * longest**2
    if thin.any():
        k = int(np.argmax(thin))
        raise InputError(
            f"{path}: {int(thin.sum())} of {len(triangles)} triangles have no area, as triangle {k} at "
            f"{_place(p[k].mean(axis=0))}; dissolve degenerate faces (in Blender: Mesh, Clean Up, Degenerate Dissolve)"
        )
    pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    once, uses = np.unique(pairs, axis=0, return_counts=True)
    if (uses > 2).any():
        a, b = once[int(np.argmax(uses))]
        raise InputError(
            f"{path}: {int((uses > 2).sum())} edges belong to more than two triangles, as the one between vertices "
            f"{a} and {b} at {_place(vertices[[a, b]].mean(axis=0))}; part the layers that meet there, or delete "
            "doubled faces"
        )
    _must_be_used(path, vertices, triangles)


def _must_be_used(path: Path, vertices: FloatArray, elements: IntArray) -> None:
    loose = np.setdiff1d(np.arange(len(vertices)), elements)
    if len(loose):
        raise InputError(
            f"{path}: {len(loose)} vertices belong to nothing, as vertex {loose[0]} at {_place(vertices[loose[0]])}; "
            f"{_LOOSE}"
        )


def _place(point: FloatArray) -> str:
    return f"({point[0]:.4g}, {point[1]:.4g}, {point[2]:.4g}) m"
