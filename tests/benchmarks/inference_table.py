"""The table of ``inference.py``: rows and columns of figures, and which goals they meet."""

import statistics
from collections.abc import Callable, Sequence

from inference_cell import RIVALS, Cell, Outcome
from inference_tasks import AS_A_SET
from rich.console import Console
from rich.table import Table as Grid
from table import Row

#: Task and number of simulations.
Line = tuple[str, int]
BEST, MDNN, AUTO = "npe-rkhs", "bayessim-mdnn", "auto"


class Figures:
    """Means over observations and seeds, by line and method.

    A method has a figure in a line only if every observation of every seed has one.
    """

    def __init__(self, outcomes: dict[Cell, Outcome]) -> None:
        self._found: dict[tuple[Line, str], list[Outcome]] = {}
        for cell, outcome in outcomes.items():
            self._found.setdefault(((cell.row, cell.simulations), cell.method), []).append(outcome)
        self.lines = list(dict.fromkeys(line for line, _ in self._found))
        self.methods = list(dict.fromkeys(method for _, method in self._found))

    def c2st(self, line: Line, method: str) -> float | None:
        return _mean([s for o in self._found.get((line, method), []) for s in (o.c2st or (None,))])

    def deviation(self, line: Line, method: str) -> float | None:
        """Standard deviation between seeds of the mean over observations; None with one seed."""
        means = [_mean(o.c2st) for o in self._found.get((line, method), [])]
        complete = [m for m in means if m is not None]
        return statistics.stdev(complete) if len(complete) > 1 else None

    def seconds(self, line: Line, method: str) -> float | None:
        """Processor seconds of training."""
        return _mean([o.train_cpu for o in self._found.get((line, method), [])])

    def wall(self, line: Line, method: str) -> float | None:
        return _mean([o.train_wall for o in self._found.get((line, method), [])])

    def notes(self) -> list[str]:
        """Why figures are missing."""
        return [
            f"{method} on {line[0]} at {line[1]}: {note}"
            for (line, method), outcomes in self._found.items()
            for note in dict.fromkeys(o.note for o in outcomes if o.note)
        ]


def _mean(values: Sequence[float | None]) -> float | None:
    complete = [v for v in values if v is not None]
    return statistics.fmean(complete) if complete and len(complete) == len(values) else None


def show(figures: Figures) -> None:
    """Two grids, with the lowest C2ST of a line in bold, and what there is to say of gaps."""
    console = Console(width=24 + 17 * len(figures.methods), highlight=False)
    wide = ".3f"
    for title, of, form in (
        ("C2ST against the known posterior (0.5 is perfect)", figures.c2st, wide),
        ("training, processor seconds", figures.seconds, ".1f"),
    ):
        grid = Grid(title=title, title_justify="left", box=None, pad_edge=False)
        grid.add_column("task")
        grid.add_column("simulations", justify="right")
        for method in figures.methods:
            grid.add_column(method, justify="right", no_wrap=True)
        for line in figures.lines:
            grid.add_row(line[0], str(line[1]), *_cells([of(line, m) for m in figures.methods], form, form == wide))
        for budget in sorted({n for _, n in figures.lines}):
            lines = _counted(figures, budget)
            means = [_mean([of(line, m) for line in lines]) for m in figures.methods]
            grid.add_row(f"mean of {len(lines)}", str(budget), *_cells(means, form, form == wide), style="italic")
        console.print()
        console.print(grid)
    for note in figures.notes():
        print(f"  - {note}")


def _cells(values: Sequence[float | None], form: str, mark: bool) -> list[str]:
    known = [v for v in values if v is not None]
    texts = ["-" if v is None else format(v, form) for v in values]
    return [
        f"[bold]{t}[/]" if mark and v is not None and v == min(known) else t for t, v in zip(texts, values, strict=True)
    ]


def _counted(figures: Figures, budget: int | None = None) -> list[Line]:
    """Lines that means and goals are over: the set is slcp over again, and rivals do not read sets."""
    return [line for line in figures.lines if not line[0].endswith(AS_A_SET) and budget in (None, line[1])]


def goals(figures: Figures) -> list[Row]:
    """Every goal that this run can tell of."""
    rows: list[Row] = []
    lines = _counted(figures)
    rivals = [m for m in figures.methods if m in RIVALS]
    singles = [m for m in figures.methods if m not in RIVALS and m != AUTO]

    def best(of: Sequence[str]) -> Callable[[Line], float | None]:
        return lambda line: min((v for m in of if (v := figures.c2st(line, m)) is not None), default=None)

    def compare(
        what: str, method: str, other: Callable[[Line], float | None], margin: float, mean_margin: float
    ) -> None:
        pairs = [
            (line, mine, theirs)
            for line in lines
            if (mine := figures.c2st(line, method)) is not None and (theirs := other(line)) is not None
        ]
        if method not in figures.methods or not pairs:
            return
        for line, mine, theirs in pairs:
            title = f"{what}, {line[0]} at {line[1]}"
            rows.append(Row(title, round(mine, 4), "", f"<= {theirs + margin:.3f}", mine <= theirs + margin))
        ours, others = (statistics.fmean(p[k] for p in pairs) for k in (1, 2))
        limit = others + mean_margin
        rows.append(Row(f"{what}, mean of {len(pairs)} rows", round(ours, 4), "", f"<= {limit:.3f}", ours <= limit))

    compare(f"{BEST} and sbi's best", BEST, best(rivals), 0.0, -0.02)
    for line in lines:
        known = [(v, m) for m in rivals if (v := figures.c2st(line, m)) is not None]
        mine = figures.seconds(line, BEST)
        theirs = figures.seconds(line, min(known)[1]) if known else None
        if mine is not None and theirs is not None:
            title = f"{BEST} and the seconds of sbi's best, {line[0]} at {line[1]}"
            rows.append(Row(title, round(mine, 1), "s", f"<= {theirs:.1f}", mine <= theirs))
    compare(f"{MDNN} and sbi-mdn", MDNN, best(["sbi-mdn"]), 0.0, 0.0)
    compare(f"{AUTO} and the best single one", AUTO, best(singles), 0.02, 0.02)
    return rows
