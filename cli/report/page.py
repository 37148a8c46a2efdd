"""The page: figures and tables put into the template, and the file written whole or not at all."""

import contextlib
import platform
import shlex
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from ...core.study.study import Study
from ...core.version import __version__
from . import words
from .calibration import calibration_section
from .figures_adequacy import adequacy_figure
from .figures_error import error_ceiling, error_figure
from .figures_map import map_figure
from .figures_object import object_figure
from .figures_points import points_figure
from .figures_posterior import axes_of, marginal_figure, pair_figure
from .figures_sets import sets_figure
from .findings import Findings, Posterior, Table, number
from .further import further_sections
from .gather import gather
from .player import player_data
from .predictive import predictive_data
from .tables import candidate_rows, key_figures, parameter_rows, recording_rows
from .verdict import thing, verdict
from .where import group_rows

#: So many recordings get a picture of the object; every one gets its error over time.
_MOST_OBJECTS = 3
_PACKAGES = ("muslin", "numpy", "zarr", "matplotlib", "torch", "mujoco", "pybullet")


def render(study: Study, after: Study | None = None) -> str:
    """The whole page as text."""
    found = gather(study, after)
    environment = Environment(
        loader=PackageLoader("muslin.cli"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["unbroken"] = unbroken
    for name in ("length", "value", "words", "share"):
        environment.filters[name] = getattr(words, name)
    return environment.get_template("report.html.j2").render(context(found))


def unbroken(text: str) -> Markup:
    """The text with ``held-out`` never parted at its hyphen."""
    return Markup(str(escape(text)).replace("held-out", '<span class="n">held-out</span>'))


def context(found: Findings) -> Table:
    """What the template needs."""
    study = found.study
    name = found.after_label
    errors = words.errors(found)
    named = (found.diagnose or {}).get("effects") or []
    best = next((c for c in found.candidates if c["name"] in named), None)
    said = verdict(found)
    return {
        "title": study.path.stem,
        "study": study.config,
        "fit": found.fit.attrs,
        "compare": found.compare,
        "diagnose": found.diagnose,
        "paragraphs": paragraphs(found, said.detail),
        "verdict": said,
        "compared": compared(found),
        "told_blind": any("not visible" in p.lower() for p in found.paragraphs),
        "key_figures": key_figures(found),
        "errors": errors,
        "after_name": name,
        "after_inferred": found.after_inferred,
        "roles": roles(found),
        "parameters": parameter_rows(found.fit, found.fit_after),
        "shown": _shown(found.fit),
        "recordings": recording_rows(found),
        "candidates": candidate_rows(found),
        "best": words.sentence(best, errors["unit"], errors["noise"], thing(found)) if best else "",
        "pictures": pictures(found, name),
        "player": player_data(found),
        "predictive": predictive_data(found),
        "groups": group_rows(found),
        "calibration": calibration_section(found.calibration),
        "further": further_sections(found),
        "engine": engine(found),
        "hidden": found.hidden,
        "provenance": provenance(found),
        "commands": commands(found),
        "study_file": study.path.read_text(encoding="utf-8") if study.path.exists() else "",
    }


def paragraphs(found: Findings, told: str) -> list[str]:
    """What the diagnosis says beyond what is on top of the page."""
    rest = found.paragraphs[1:] if (found.diagnose or {}).get("verdict") == "named" else found.paragraphs
    return [p for p in rest if p != told]


def compared(found: Findings) -> str:
    """The comparison in one sentence; its table is a table of this page."""
    if found.compare is None:
        return ""
    last = (str(found.compare.get("text") or "").splitlines() or [""])[-1]
    p = number(found.compare.get("p_value"))
    return last if p is None or "(p " in last else f"{last} (p\u00a0=\u00a0{words.value(p)})"


def pictures(found: Findings, name: str) -> Table:
    """Every figure as SVG text or image address."""
    axes = axes_of(found.fit, found.fit_after)
    top = error_ceiling(found.takes) if found.takes else 1.0
    objects = [(t, object_figure(t, name)) for t in found.takes[:_MOST_OBJECTS]]
    points = [(t, points_figure(t, i)) for i, t in enumerate(found.takes[:_MOST_OBJECTS])]
    maps = [(t, map_figure(t)) for t in found.takes[:_MOST_OBJECTS]]
    sets = [(t, sets_figure(t)) for t in found.takes[:_MOST_OBJECTS]]
    return {
        "marginals": [marginal_figure(a, i) for i, a in enumerate(axes)],
        "pairs": pair_figure(axes),
        "errors": [(t, error_figure(t, top, i)) for i, t in enumerate(found.takes)],
        "objects": [(t, picture) for t, picture in objects if picture],
        "points": [(t, picture) for t, picture in points if picture],
        "maps": [(t, picture) for t, picture in maps if picture],
        "sets": [(t, picture) for t, picture in sets if picture],
        "adequacy": adequacy_figure(found.compare),
    }


def roles(found: Findings) -> Table:
    """Names of recordings by role, from the comparison or else from the study file and its measurement."""
    if found.takes:
        fit = [t.name for t in found.takes if not t.held_out]
        return {"fit": fit, "held out": [t.name for t in found.takes if t.held_out]}
    table = found.study.config.study
    return {"fit": table.fit_on or ["every recording that is not held out"], "held out": table.hold_out}


def _shown(fit: Posterior) -> Table:
    noise = fit.attrs.get("noise") or {}
    return {"noise": words.length(noise.get("sd"), noise.get("unit", "m")), "source": noise.get("source", "")}


def provenance(found: Findings) -> list[tuple[str, str]]:
    """What produced these results, line by line."""
    fit, rows = found.fit.attrs, [("muslin", __version__)]
    rows.append(("simulator", engine(found)))
    rows.append(("estimator", str(fit.get("estimator", found.study.config.estimator.name))))
    failed = f", {fit['failed']} failed" if number(fit.get("failed")) else ""
    rows.append(("fit", f"seed {fit.get('seed')}, {fit.get('simulations')} simulations{failed}, {_seconds(fit)}"))
    if found.diagnose is not None:
        d = found.diagnose
        rows.append(("diagnosis", f"seed {d.get('seed')}, {d.get('simulations')} simulations, {_seconds(d)}"))
    results = found.study.results_path
    changed = datetime.fromtimestamp(results.stat().st_mtime, UTC)
    rows.append(("results", f"{results.name}, {changed:%Y-%m-%d %H:%M} UTC"))
    rows.append(("measurement", found.study.config.study.measurement))
    rows.append(("report written", f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC"))
    installed = []
    for package in _PACKAGES[1:]:
        with contextlib.suppress(PackageNotFoundError):
            installed.append(f"{package} {version(package)}")
    rows.append(("written with", f"Python {platform.python_version()}, {', '.join(installed)}, {platform.platform()}"))
    return rows


def engine(found: Findings) -> str:
    """The simulator with the version of its engine."""
    name, said = found.study.config.simulator.name, str(found.fit.attrs.get("engine") or "engine version unknown")
    return said if said.startswith(name) else f"{name}, {said}"


def _seconds(table: Table) -> str:
    seconds = number(table.get("seconds"))
    return f"{seconds:.0f} s" if seconds is not None else "time unknown"


def commands(found: Findings) -> list[str]:
    """Commands that make these results again."""
    file = _quoted(found.study.path.name)
    out = [f"muslin fit {file}"]
    if found.compare is not None:
        out.append(f"muslin compare {file}")
    if found.diagnose is not None:
        out.append(f"muslin diagnose {file}")
    if found.calibration is not None:
        out.append(f"muslin calibrate {file}")
    if found.after is not None and found.after_inferred:
        other = _quoted(found.after.path.name)
        added = [e for e in found.after.config.effects if e not in found.study.config.effects]
        out += [f"muslin add {','.join(added)} {file} -o {other}"] if added else []
        out += [f"muslin fit {other}", f"muslin compare {other}"]
    return [*out, f"muslin report {file}"]


def _quoted(name: str) -> str:
    return shlex.quote(name)
