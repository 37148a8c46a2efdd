"""Makes shirt.obj: a sleeveless shirt, front and back sewn at the sides and the shoulders, open at neck, arms and hem.

python examples/own_mesh/make_shirt.py
"""

from pathlib import Path

import numpy as np

WIDTH, HEIGHT, DEPTH = 0.36, 0.48, 0.05  # [m]
COLUMNS, ROWS = 8, 9  # cells
ARMPIT = 3  # rows of cells from the shoulders down to it
SHOULDER = 2  # cells of a shoulder, between arm and neck
NECK_FRONT, NECK_BACK = 2, 1  # rows of cells that are cut out


def cloth(row: int, column: int, neck: int) -> bool:
    """Whether a cell is cloth."""
    strap = 1 <= column < COLUMNS - 1 if row < ARMPIT else True
    cut = row < neck and 1 + SHOULDER <= column < COLUMNS - 1 - SHOULDER
    return strap and not cut


def sewn(row: int, column: int) -> bool:
    """Whether front and back share this corner of cells: at the sides below the arms and on the shoulders."""
    side = row >= ARMPIT and column in (0, COLUMNS)
    inside = min(column, COLUMNS - column)
    return side or (row == 0 and 1 <= inside <= 1 + SHOULDER)


def place(row: int, column: int, side: int) -> tuple[float, float, float]:
    """Of a corner of cells [m]: z down from the shoulders, the panels bulging apart between the seams."""
    across = 2 * column / COLUMNS - 1
    bulge = 0.0 if sewn(row, column) else DEPTH * np.sqrt(max(1.02 - across**2, 0.0)) * min(1.0, 0.3 + 0.3 * row)
    return WIDTH / 2 * across, side * bulge, -HEIGHT * row / ROWS


def main(path: Path) -> None:
    numbers: dict[tuple[int, int, int], int] = {}
    vertices: list[tuple[float, float, float]] = []
    faces: list[tuple[int, int, int]] = []

    def number(row: int, column: int, side: int) -> int:
        key = (row, column, 0 if sewn(row, column) else side)
        if key not in numbers:
            numbers[key] = len(vertices)
            vertices.append(place(row, column, side))
        return numbers[key]

    for side, neck in ((-1, NECK_FRONT), (1, NECK_BACK)):
        for row in range(ROWS):
            for column in range(COLUMNS):
                if cloth(row, column, neck):
                    a, b = number(row, column, side), number(row, column + 1, side)
                    d, e = number(row + 1, column, side), number(row + 1, column + 1, side)
                    halves = [(a, d, e), (a, e, b)] if (row + column) % 2 else [(a, d, b), (b, d, e)]
                    faces += halves if side < 0 else [(p, r, q) for p, q, r in halves]
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in vertices]
    lines += [f"f {p + 1} {q + 1} {r + 1}" for p, q, r in faces]
    path.write_text("\n".join(lines) + "\n")
    print(f"wrote {path.name}: {len(vertices)} vertices, {len(faces)} triangles")


if __name__ == "__main__":
    main(Path(__file__).with_name("shirt.obj"))
