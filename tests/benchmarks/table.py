"""What every benchmark prints and writes: a table for people, ``results/NAME.json`` for the record."""

import json
import os
import platform
import subprocess
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

RESULTS = Path(__file__).resolve().parents[2] / "results"
PACKAGES = ("muslin", "mujoco", "pybullet", "torch", "monai", "kornia", "numpy", "scipy")


@dataclass(frozen=True)
class Row:
    """One figure. ``goal`` is text such as ">= 6"; ``met`` is None where there is no goal."""

    figure: str
    value: float | str
    unit: str
    goal: str = ""
    met: bool | None = None


def machine() -> str:
    """Processor and cores, as this process may use them."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line.split(":", 1)[1].strip() for line in cpuinfo.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    return f"{model}, {len(os.sched_getaffinity(0))} cores, Python {platform.python_version()}"


def versions() -> dict[str, str]:
    out = {}
    for name in PACKAGES:
        try:
            out[name] = version(name)
        except PackageNotFoundError:
            out[name] = "not installed"
    return out


def commit() -> str:
    """Of the sources, with a plus sign if they were changed since; "unknown" outside a repository.

    What benchmarks themselves write is no source, so that of several rows all are of one commit.
    """

    def git(*asked: str) -> str:
        return subprocess.run(["git", "-C", str(RESULTS.parent), *asked], capture_output=True, text=True).stdout.strip()

    found = git("describe", "--always", "--exclude=*") or "unknown"
    return found + ("+" if git("diff", "HEAD", "--name-only", "--", ":!results", ":!docs") else "")


def row(cells: Sequence[str]) -> str:
    """A row of a table in Markdown."""
    return f"| {' | '.join(cells)} |"


def report(name: str, rows: Sequence[Row], seeds: Sequence[int], seconds: float) -> Path:
    """Print the table and write it; a missed goal stays in the table as missed."""
    width = max(len(r.figure) for r in rows)
    print(f"\n{name}: {machine()}")
    for r in rows:
        value = f"{r.value:.4g}" if isinstance(r.value, float) else str(r.value)
        goal = f"  goal {r.goal}: {'met' if r.met else 'MISSED'}" if r.goal else ""
        print(f"  {r.figure:<{width}}  {value} {r.unit}{goal}")
    path = write(name, rows, seeds, seconds)
    print(f"wrote {path}")
    return path


def write(name: str, rows: Sequence[Row], seeds: Sequence[int], seconds: float) -> Path:
    """Write the table alone: what a long run has so far."""
    content = {
        "machine": machine(),
        "versions": versions(),
        "seeds": list(seeds),
        "seconds": round(seconds, 1),
        "rows": [asdict(r) for r in rows],
    }
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return path
