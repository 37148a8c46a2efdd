"""``muslin fit``, ``compare``, ``diagnose``, ``add`` and ``report``: the steps of a study."""

from pathlib import Path
from typing import Annotated

import typer

from ..core.errors import InputError
from ..core.registry import REGISTRY
from ..core.study import Study
from .console import ProgressView, add_command, command, next_step, say
from .output import check_apart, check_output, check_result, write_json

StudyFile = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file, made with muslin new.")]
Workers = Annotated[
    int | None,
    typer.Option(min=1, metavar="N", help="Worker processes; default one a core. The result does not depend on it."),
]
Force = Annotated[bool, typer.Option("--force", help="Replace a file that is there already.")]


def add_to(app: typer.Typer) -> None:
    """Add the commands of this file."""
    app.command("fit")(fit)
    app.command("compare")(compare)
    app.command("diagnose")(diagnose)
    app.command("add")(add)
    app.command("report")(report)


def fit(study: StudyFile, workers: Workers = None) -> None:
    """Fit the simulator to the recordings that the study fits on.

    Simulates draws from the prior, trains the estimator on them, and draws again where the posterior lies.
    Interrupted, it goes on from the draws it had when it is run again; a finished fit is shown at once.
    """
    with ProgressView() as progress:
        result = Study.load(study, workers=workers, progress=progress).fit()
    say(result.text())
    next_step(command("compare", study))


def compare(
    study: StudyFile,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write what was found to this JSON file, too.")
    ] = None,
    workers: Workers = None,
) -> None:
    """Hold the fitted simulator against every recording: how large the error is, where, when, and is it noise?"""
    with ProgressView() as progress:
        loaded = Study.load(study, workers=workers, progress=progress)
        if json_file is not None:
            check_result(json_file, ".json", loaded)
        result = loaded.compare()
    say(result.text())
    if json_file is not None:
        write_json(json_file, result.to_json())
        say(f"wrote {json_file}")
    next_step(command("diagnose", study), command("report", study))


def diagnose(
    study: StudyFile,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the verdict to this JSON file, too.")
    ] = None,
    workers: Workers = None,
) -> None:
    """Say which physical effect the simulator lacks.

    The verdict is one of: named (this effect), tied (these cannot be told apart), none (a misfit that no
    candidate explains), cannot-tell (the data could not show it), no-misfit.
    """
    with ProgressView() as progress:
        loaded = Study.load(study, workers=workers, progress=progress)
        if json_file is not None:  # hours of simulation must not end at a misspelt folder
            check_result(json_file, ".json", loaded)
        result = loaded.diagnose()
    say(result.text())
    verdict = result.to_json()
    if json_file is not None:
        write_json(json_file, verdict)
        say(f"wrote {json_file}")
    effects = verdict.get("effects") or []
    if verdict.get("verdict") in ("named", "tied") and effects:
        tied, beside = verdict.get("verdict") == "tied", verdict.get("further") or []
        chosen = [effects[0], *beside] if tied else effects
        further = [command("next", study)] if tied or beside else []
        next_step(add_command(study, chosen), *further, command("report", study))
    else:
        further = {"none": ["unknown"], "cannot-tell": ["next"]}.get(str(verdict.get("verdict")), [])
        in_pixels = verdict.get("error", {}).get("unit") == "px"  # unknown needs metres
        if verdict.get("unfinished") or (in_pixels and "unknown" in further):
            further = []
        next_step(*(command(step, study) for step in further), command("report", study))


def add(
    effect: Annotated[
        str | None,
        typer.Argument(metavar="EFFECT[,EFFECT]", help="Names of effects; muslin plugins lists them. None with --law."),
    ] = None,
    study: Annotated[
        Path | None, typer.Argument(metavar="STUDY.toml", help="The study file, made with muslin new.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="STUDY2.toml", help="The new study file; default STUDY-with-EFFECT.toml."
        ),
    ] = None,
    law: Annotated[
        Path | None, typer.Option("--law", metavar="FILE", help="Add the law of a file of muslin unknown --json.")
    ] = None,
    force: Force = False,
) -> None:
    """Write a study of the same model with more effects, their coefficients inferred from the recordings."""
    if effect is None:
        raise InputError("name what to add and to which study: muslin add EFFECT STUDY.toml, or --law FILE STUDY.toml")
    if law is not None and study is not None:
        raise InputError(f"name either the effect {effect!r} or a law, not both: muslin add --law FILE STUDY.toml")
    if law is None and study is None:
        raise InputError(f"name an effect and a study, or a law file and a study; got {effect!r} alone")
    source = Path(effect) if study is None else study
    names = [name.strip() for name in effect.split(",")] if law is None else ["law"]
    loaded = Study.load(source)
    target = output or loaded.path_with(names)
    check_apart(target, loaded)
    check_output(target, force)
    if law is not None and target.resolve() == law.resolve():
        raise InputError(f"{law} is the law itself; name another file to write")
    made = (
        loaded.add(names, target, overwrite=force)
        if law is None
        else REGISTRY.get("step", "add-law")(loaded, law, target, overwrite=force)
    )
    what = " and ".join(names) if law is None else f"the law of {law}"
    say(f"wrote {made.path}: the model of {source} with {what}")
    next_step(
        f"{command('fit', made.path)} && {command('compare', made.path)} && "
        f"{command('report', source, '--after', made.path)}"
    )


def report(
    study: StudyFile,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="REPORT.html", help="The HTML file; default beside the study."),
    ] = None,
    after: Annotated[
        Path | None,
        typer.Option(
            "--after",
            metavar="STUDY2.toml",
            help="A compared study with what was added; its errors are shown as after.",
        ),
    ] = None,
) -> None:
    """Write one self-contained HTML file: fit, errors over time, ranking of effects, before and after."""
    from .report import write_report

    loaded, later = Study.load(study), Study.load(after) if after is not None else None
    if output is not None:
        check_result(output, ".html", *(s for s in (loaded, later) if s is not None))
    made = write_report(loaded, output, later)
    say(f"wrote {made}")
    say("open it in a browser; it needs no other file")
