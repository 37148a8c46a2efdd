"""Long-form CSV: one row an observation, every complaint with its line number."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError


@dataclass(frozen=True)
class Row:
    """One line of a table: its number in the file and its cells by column."""

    line: int
    cells: dict[str, str]


@dataclass(frozen=True)
class Table:
    """A CSV file with a header line.

    Args:
        path: of the file, for messages.
        columns: names in the header, lower case.
        rows: in order; empty lines left out.
    """

    path: Path
    columns: tuple[str, ...]
    rows: list[Row]

    def number(self, row: Row, column: str, *, gap: bool = False) -> float:
        """A cell as a number; with ``gap``, an empty cell or ``nan`` is NaN.

        Raises:
            InputError: names line, column and cell.
        """
        text = row.cells[column].strip()
        if gap and text.lower() in ("", "nan", "na"):
            return float("nan")
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if value != value or value in (float("inf"), float("-inf")):
            wanted = "a finite number, or nothing where the point was not seen" if gap else "a finite number"
            raise InputError(f"{self.path}, line {row.line}: {column} must be {wanted}, but is {text!r}")
        return value


def read_table(path: Path, required: Sequence[str], optional: Sequence[str] | None) -> Table:
    """Read a comma-, semicolon- or tab-separated file whose first line names its columns.

    Args:
        path: of the file.
        required: columns that must be there.
        optional: columns that may be there; any other is refused, so that a misspelt one is noticed. With None all may
            be there, as in what a program has exported.

    Raises:
        InputError: not such a file; says which line or column.
    """
    rows: list[Row] = []
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            first = file.readline()
            separator = max(",;\t", key=first.count)
            columns = tuple(c.strip().lower() for c in next(csv.reader([first], delimiter=separator), []))
            _check_columns(path, columns, required, optional)
            reader = csv.reader(file, delimiter=separator)
            for cells in reader:
                line = reader.line_num + 1
                if not any(c.strip() for c in cells):
                    continue
                if len(cells) != len(columns):
                    raise InputError(
                        f"{path}, line {line}: {len(cells)} cells, but the header names {len(columns)} columns "
                        f"({', '.join(columns)})"
                    )
                rows.append(Row(line, dict(zip(columns, cells, strict=True))))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path} is not a CSV text file: {error}") from error
    if not rows:
        raise InputError(f"{path} has no rows below its header")
    return Table(path, columns, rows)


def _check_columns(path: Path, columns: Sequence[str], required: Sequence[str], optional: Sequence[str] | None) -> None:
    layout = f"columns are {', '.join(required)}" + (f" and optionally {', '.join(optional)}" if optional else "")
    if not any(columns):
        raise InputError(f"{path} is empty; its first line must name the columns: {layout}")
    twice = sorted({c for c in columns if columns.count(c) > 1})
    if twice:
        raise InputError(f"{path}: column {twice[0]!r} is there twice; {layout}")
    missing = [c for c in required if c not in columns]
    if missing:
        found = ", ".join(columns)
        raise InputError(f"{path}: column {missing[0]!r} is missing; {layout}; found {found:.200}")
    unknown = [c for c in columns if optional is not None and c not in (*required, *optional)]
    if unknown:
        raise InputError(f"{path}: column {unknown[0]!r} is not known; {layout}")
