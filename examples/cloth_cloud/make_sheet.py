"""A square sheet that lies level on a table with one corner at a point, as OBJ::

python examples/cloth_cloud/make_sheet.py --corner 0.563 0.151 0.056 -o examples/cloth_cloud/lift.obj
python examples/cloth_cloud/make_sheet.py --corner 0.836 0.181 0.086 --towards -1 -o examples/cloth_cloud/fold.obj
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def sheet(
    side: float, count: int, corner: tuple[float, float, float], towards: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices ``(N, 3)`` [m] and triangles ``(F, 3)``.

    Args:
        side: length [m].
        count: vertices along a side.
        corner: where one corner is [m].
        towards: direction of the diagonal from there, 1 along x, -1 against it.
    """
    a, b = np.meshgrid(np.linspace(0, side, count), np.linspace(0, side, count), indexing="ij")
    along, across = (a + b) / np.sqrt(2), (a - b) / np.sqrt(2)
    vertices = np.stack([towards * along, towards * across, 0 * a], axis=-1).reshape(-1, 3) + np.array(corner)
    number = np.arange(count * count).reshape(count, count)
    triangles = []
    for i in range(count - 1):
        for j in range(count - 1):
            p, q, r, s = number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]
            # diagonals alternate, so that no direction is stiffer than another
            triangles += [(p, q, r), (p, r, s)] if (i + j) % 2 == 0 else [(p, q, s), (q, r, s)]
    return vertices, np.array(triangles)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--side", type=float, default=0.28, help="[m]")
    parser.add_argument("--count", type=int, default=9, help="of vertices along a side")
    parser.add_argument("--corner", type=float, nargs=3, required=True, help="where the gripper starts [m]")
    parser.add_argument("--towards", type=float, choices=(1, -1), default=1, help="diagonal along x, or against it")
    parser.add_argument("-o", "--output", type=Path, required=True)
    a = parser.parse_args()
    vertices, triangles = sheet(a.side, a.count, tuple(a.corner), a.towards)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices] + [f"f {i} {j} {k}" for i, j, k in triangles + 1]
    a.output.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
