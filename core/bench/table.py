"""The bench as text."""

from .bench import Report
from .outcome import Outcome

_HEAD = ("test", "object", "asked", "delivered", "error", "within from", "settled from", "s", "")


def row(o: Outcome) -> tuple[str, ...]:
    """The cells of one line: delivered and error on the finest mesh that ran."""
    asked = "-" if o.asked is None else f"{o.asked:.4g} {_unit(o)}"
    given = f"{o.delivered[-1]:.4g}" if o.delivered else "-"
    error = "-" if not o.asked or o.error is None else f"{100 * o.error:+.1f} %"
    within, settled = ("-" if m is None else str(m) for m in (o.within_from, o.settled_from))
    mesh = f" @{o.meshes[-1]}" if o.meshes else ""
    what = f"{o.kind}, {o.label}: {o.quantity}"
    return o.test, what, asked, given + mesh, error, within, settled, f"{sum(o.seconds):.1f}", o.status


def lines(report: Report) -> list[str]:
    """The table of a report, its notes and its summary, ready to print.

    ``delivered @n`` is on n cells, the finest mesh that ran; ``within from``: the coarsest mesh from which on all are
    within the goal; ``settled from``: from which on nothing changes by more than 1 %.
    """
    claimed = [o for o in report.outcomes if o.claimed]
    rows = [_HEAD, *(row(o) for o in claimed)]
    widths = [max(len(r[k]) for r in rows) for k in range(len(_HEAD))]
    out = [f"{report.simulator} ({report.engine}), {report.machine}"]
    out += ["  ".join(c.ljust(w) for c, w in zip(r, widths, strict=True)).rstrip() for r in rows]
    counts = dict.fromkeys(f"{o.test}: {o.cells}" for o in claimed)
    out.append(f"cells are counted: {'; '.join(counts)}")
    notes = dict.fromkeys(f"  {o.test}, {o.kind}, {o.label}: {o.reason}" for o in claimed if o.reason)
    out += ["did not run:", *notes] if notes else []
    silent: dict[str, list[str]] = {}
    for o in report.outcomes:
        if not o.claimed and o.test not in silent.setdefault(o.reason, []):
            silent[o.reason].append(o.test)
    out += ["not claimed:", *(f"  {', '.join(names)}: {reason}" for reason, names in silent.items())] if silent else []
    met, missed = (sum(o.status == s for o in report.outcomes) for s in ("met", "MISS"))
    failed = sum(o.status == "FAILED" for o in report.outcomes)
    out.append(f"{met} met, {missed} MISS, {failed} failed, {report.seconds:.0f} s")
    out.append(f"{report.simulator}: {report.summary}")
    return out


def _unit(o: Outcome) -> str:
    return "" if o.unit == "1" else o.unit
