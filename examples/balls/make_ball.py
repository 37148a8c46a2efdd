"""A ball as a small tetrahedral mesh, at the height where it is let go.

An icosahedron about its own centre: 13 vertices, 20 tetrahedra. Seen from below it is as large as the ball, so that a
drag coefficient is that of the ball. Prints the density that gives it the mass of the ball::

    python examples/balls/make_ball.py --diameter 0.067 --mass 0.058 --height 47.3 -o examples/balls/tennis.vtk
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_GOLDEN = (1 + 5**0.5) / 2


def icosahedron() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Corners ``(12, 3)`` and outward faces ``(20, 3)``."""
    pairs = [(s, t * _GOLDEN) for s in (-1, 1) for t in (-1, 1)]
    corners = np.array([np.roll([0.0, s, t], k) for k in range(3) for s, t in pairs])
    near = np.linalg.norm(corners[:, None] - corners[None], axis=2) < 2.1
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] & near[j, k] & near[i, k]
    ]
    out = [f if np.linalg.det(corners[list(f)]) > 0 else f[::-1] for f in faces]
    return corners, np.array(out)


def ball(diameter: float, height: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices ``(13, 3)`` [m], the last of them the centre, and tetrahedra ``(20, 4)``."""
    corners, faces = icosahedron()
    p = corners[faces]
    normals = 0.5 * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    below = -normals[:, 2][normals[:, 2] < 0].sum()  # its area as seen from below
    corners = corners * np.sqrt(np.pi * diameter**2 / 4 / below)
    vertices = np.concatenate([corners, np.zeros((1, 3))]) + np.array([0.0, 0.0, height])
    return vertices, np.concatenate([np.full((20, 1), 12), faces], axis=1)


def write(path: Path, diameter: float, height: float) -> float:
    """Write the mesh as VTK; its volume [m3]."""
    vertices, cells = ball(diameter, height)
    points = "\n".join(" ".join(f"{x:.7g}" for x in p) for p in vertices)
    tetrahedra = "\n".join("4 " + " ".join(str(i) for i in c) for c in cells)
    path.write_text(
        f"# vtk DataFile Version 3.0\nball of {diameter:g} m\nASCII\nDATASET UNSTRUCTURED_GRID\n"
        f"POINTS {len(vertices)} double\n{points}\nCELLS {len(cells)} {5 * len(cells)}\n{tetrahedra}\n"
        f"CELL_TYPES {len(cells)}\n" + "10\n" * len(cells)
    )
    edges = vertices[cells[:, 1:]] - vertices[cells[:, :1]]
    return float(np.abs(np.linalg.det(edges)).sum() / 6)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, unit in (("diameter", "m"), ("mass", "kg"), ("height", "m")):
        parser.add_argument(f"--{name}", type=float, required=True, help=f"[{unit}]")
    parser.add_argument("-o", "--output", type=Path, required=True)
    told = parser.parse_args()
    volume = write(told.output, told.diameter, told.height)
    print(f"wrote {told.output}; density = {told.mass / volume:.1f}   # of the mesh, for {told.mass:g} kg [kg/m3]")


if __name__ == "__main__":
    main()
