"""``muslin plugins`` and ``muslin check``: what is installed, and whether it keeps its promises."""

import json
from dataclasses import asdict
from itertools import groupby
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..core.errors import InputError, UnknownPluginError
from ..core.registry import GROUPS, REGISTRY, PluginInfo, nearest
from ..core.testing import KITS, run_checks
from .console import say


def add_to(app: typer.Typer) -> None:
    """Add the commands of this file."""
    app.command("plugins")(plugins)
    app.command("check")(check)


def plugins(as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False) -> None:
    """List the installed plugins; of a broken one, why it cannot be loaded."""
    rows = REGISTRY.inventory()
    if as_json:
        say(json.dumps([asdict(r) for r in rows], indent=2))
        return
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column()
    for kind, its in groupby(rows, lambda row: row.kind):
        table.add_row(Text(f"{kind}s" if kind in GROUPS else kind, "bold"))
        for row in its:
            # Text: a cause may hold square brackets, which are not markup
            table.add_row(f"  {row.name}", Text(_told(row), "red" if row.error else ""))
    console = Console()
    if not console.is_terminal:
        console.width = 200
    console.print(table)
    broken = sum(1 for r in rows if r.error)
    say(f"{len(rows)} plugins, {broken} broken; check one with: muslin check NAME")


def _told(row: PluginInfo) -> str:
    told = f"broken: {row.error}" if row.error else row.about
    plugin = REGISTRY.get("effect", row.name) if row.kind == "effect" and not row.error else None
    kinds = sorted(getattr(plugin, "object_kinds", None) or ())  # what is no effect at all is for muslin check to say
    acts = f"[{', '.join(kinds)}]" if kinds else ""
    whose = "" if row.distribution.startswith("muslin ") else f"({row.distribution})"
    return " ".join(filter(None, (told, acts, whose)))


def check(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of a plugin, as muslin plugins lists it.")],
) -> None:
    """Run the conformance kit on a plugin. Exit status 0 if all checks pass, 1 if one fails."""
    kinds = [kind for kind in GROUPS if name in REGISTRY.names(kind)]
    if not kinds:
        known = sorted({n for kind in KITS for n in REGISTRY.names(kind)})
        raise UnknownPluginError(f"there is no plugin {name!r}.{nearest(name, known)} Installed: {', '.join(known)}")
    if not any(kind in KITS for kind in kinds):
        raise InputError(f"{name!r} is a {kinds[0]}; there is no conformance kit for those, only for {', '.join(KITS)}")
    failed = passed = 0
    for kind in (k for k in kinds if k in KITS):
        plugin = REGISTRY.get(kind, name)
        say(f"{kind} {name}")
        for title, error in run_checks(kind, plugin):
            failed, passed = failed + (error is not None), passed + (error is None)
            say(f"  pass  {title}" if error is None else f"  FAIL  {title}: {error}")
    say(f"{passed} passed, {failed} failed")
    if failed:
        raise typer.Exit(1)
