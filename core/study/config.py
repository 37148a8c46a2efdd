"""The study file: one TOML table a topic, every key checked."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from ..errors import InputError, MissingFileError
from ..registry import nearest
from ..store import write_text
from .scenario_table import OBSTACLES, ScenarioTable, StrictTable


class _OpenTable(BaseModel):
    model_config = ConfigDict(extra="allow", allow_inf_nan=False)

    name: str

    @property
    def options(self) -> dict[str, Any]:
        """Options of the plugin itself: every key that muslin does not know."""
        return dict(self.model_extra or {})


class StudyTable(StrictTable):
    """``[study]``: what is fitted on what; a simulation that takes longer than ``time_limit`` [s] has failed.

    With ``window`` [s] recordings are fitted in pieces of about that length, each of which starts as measured.
    """

    measurement: str
    fit_on: list[str] | None = None
    hold_out: list[str] = Field(default_factory=list)
    results: str | None = None
    seed: int = Field(default=0, ge=0)
    time_limit: float = Field(default=120.0, gt=0)
    window: float | None = Field(default=None, gt=0)

    @field_validator("fit_on")
    @classmethod
    def _some(cls, names: list[str] | None) -> list[str] | None:
        if names == []:
            raise ValueError("names no recording; leave it out to fit on every one that is not held out")
        return names


class EstimatorTable(_OpenTable):
    """``[estimator]``: which one, how many rounds at most, how many simulated draws a round.

    ``proposal``: where the draws of later rounds come from; default ``"truncated"``, and ``"gaussian"``, the
    paper's, with ``preset = "paper"``. ``stop``: rounds end early once the posterior has moved by less than this
    [its standard deviations] twice in a row; 0 runs them all.
    """

    rounds: int = Field(default=2, ge=1)
    draws: int = Field(default=120, ge=10)
    proposal: Literal["truncated", "posterior", "gaussian"] | None = None
    stop: float = Field(default=0.2, ge=0)

    @property
    def proposals(self) -> Literal["truncated", "posterior", "gaussian"]:
        """``proposal``, or the one that goes with the preset."""
        return self.proposal or ("gaussian" if self.options.get("preset") == "paper" else "truncated")


class ParameterTable(StrictTable):
    """``[parameters.NAME]``: bounds of a uniform prior."""

    low: float
    high: float
    scale: Literal["linear", "log"] = "linear"
    unit: str | None = None


class NoiseTable(StrictTable):
    """``[noise]``: standard deviation of the measurement, if it is known.

    With ``tails``, a fit and a diagnosis count frames that are further off than so many of it by a logarithm only, for
    motions of which parts are left to chance.
    """

    sd: float | None = Field(default=None, gt=0)
    tails: float | None = Field(default=None, ge=1, le=1e6)


class NuisanceTable(StrictTable):
    """``[nuisance]``: prior standard deviations of what may be off in the measurement itself."""

    clock_offset: float = Field(default=0.0, ge=0)
    constant_offset: float = Field(default=0.0, ge=0)


class DiagnoseTable(StrictTable):
    """``[diagnose]``: which effects to try, from how many points each at most, with how many simulations in all.

    Those of all pieces that a recording is cut into (``[study] window``) count as one. None: as many as suit the object
    and the number of recordings that are fitted.
    """

    candidates: list[str] | None = None
    draws: int = Field(default=16, ge=4)
    simulations: int | None = Field(default=None, ge=100)


class StudyConfig(StrictTable):
    """A whole study file."""

    study: StudyTable
    scenario: ScenarioTable
    simulator: _OpenTable
    extractor: _OpenTable = Field(default_factory=lambda: _OpenTable(name="markers"))
    estimator: EstimatorTable = Field(default_factory=lambda: EstimatorTable(name="npe-rkhs"))
    material: dict[str, float] = Field(default_factory=dict)
    parameters: dict[str, ParameterTable] = Field(default_factory=dict)
    effects: dict[str, dict[str, float | ParameterTable]] = Field(default_factory=dict)
    noise: NoiseTable = Field(default_factory=NoiseTable)
    nuisance: NuisanceTable = Field(default_factory=NuisanceTable)
    diagnose: DiagnoseTable = Field(default_factory=DiagnoseTable)

    @property
    def files(self) -> list[str]:
        """Meshes and what an extractor has learned, as they are written; not its stores."""
        learned = self.extractor.options.get("weights")
        return [*self.scenario.files, *([learned] if isinstance(learned, str) else [])]

    def move_files(self, to: Callable[[str], str]) -> None:
        """Name every one of :attr:`files` anew."""
        self.scenario.move_files(to)
        if isinstance(learned := self.extractor.options.get("weights"), str):
            self.extractor = self.extractor.model_copy(update={"weights": to(learned)})

    @model_validator(mode="after")
    def _disjoint(self) -> "StudyConfig":
        for key, names in (("fit_on", self.study.fit_on or []), ("hold_out", self.study.hold_out)):
            twice = sorted({n for n in names if names.count(n) > 1})
            if twice:
                raise ValueError(f"{key} names {', '.join(twice)} twice")
        both = sorted(set(self.study.fit_on or []) & set(self.study.hold_out))
        if both:
            raise ValueError(f"recording {', '.join(both)} is both fitted on and held out")
        return self

    @model_validator(mode="after")
    def _pieces_start_as_measured(self) -> "StudyConfig":
        if self.study.window is not None and self.scenario.start != "measured":
            raise ValueError(
                "study.window cuts recordings into pieces that start as they were measured, so it needs [scenario] "
                "start = 'measured'"
            )
        return self

    @model_validator(mode="after")
    def _length_is_measured(self) -> "StudyConfig":
        if self.scenario.start == "measured" and "scale" in self.parameters:
            raise ValueError(
                "parameters.scale does not go with start = 'measured', which takes the length of the rope from "
                "each take; leave it out"
            )
        return self


def parse_config(table: dict[str, Any], where: str) -> StudyConfig:
    """Check a table that came from ``where`` (a file name, for messages)."""
    try:
        return StudyConfig.model_validate(table)
    except ValidationError as error:
        lines = []
        for e in error.errors():
            place = ".".join(str(p) for p in e["loc"]) or "the file"
            if e["type"] == "extra_forbidden":
                known = _known_keys(e["loc"])
                lines.append(
                    f"[{place}] is not a key here.{nearest(str(e['loc'][-1]), known)} Keys: {', '.join(known)}"
                )
            elif e["type"] == "missing" and isinstance(e["loc"][-1], int):
                lines.append(f"[{place.rpartition('.')[0]}] has too few numbers; got {e['input']!r:.80}")
            elif e["type"] == "missing":
                lines.append(f"[{place}] is missing")
            elif e["type"].startswith("union_tag"):
                tag, kinds = str(e.get("ctx", {}).get("tag", "")), list(OBSTACLES)
                what = f"there is no obstacle of kind {tag!r}.{nearest(tag, kinds)}" if tag else "kind is missing."
                lines.append(f"[{place}] {what} Kinds: {', '.join(kinds)}")
            elif e["type"] in ("list_type", "tuple_type"):
                lines.append(f"[{place}] must be a list, [ ... ]; got {e['input']!r:.80}")
            else:
                got = "" if isinstance(e["input"], dict) else f"; got {e['input']!r:.80}"
                lines.append(f"[{place}] {e['msg'].removeprefix('Value error, ')}{got}")
        raise InputError(f"{where}: " + "; ".join(lines)) from error


def _known_keys(loc: tuple[int | str, ...]) -> list[str]:
    """Keys of the table that ``loc`` names but for its last part."""
    models: list[Any] = [StudyConfig]
    for part in loc[:-1]:
        fields = [m.model_fields[str(part)] for m in models if str(part) in m.model_fields]
        inner = [table for f in fields for table in _models(f.annotation)]
        # what is not a field is an index, a name that the user chose, or the kind of an obstacle
        kinds = [m for m in models if part in get_args(getattr(m.model_fields.get("kind"), "annotation", None))]
        models = inner or kinds or models
    return list(dict.fromkeys(name for m in models for name in m.model_fields))


def _models(annotation: Any) -> list[Any]:
    """The tables that a value of this type may be, through lists, dictionaries and unions."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if get_origin(annotation) is None:
        return []
    return [m for part in get_args(annotation) for m in _models(part)]


def read_config(path: Path) -> StudyConfig:
    """Read a study file."""
    if not path.exists():
        raise MissingFileError(f"there is no study file {path}; make one with: muslin new {path} --measurement ...")
    if path.is_dir():
        raise InputError(f"{path} is a folder; name the study file in it")
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is not valid TOML: {error}") from error
    return parse_config(table, str(path))


def write_config(config: StudyConfig, path: Path) -> None:
    """Write a study file, without the keys that were left at their default."""
    table = config.model_dump(exclude_defaults=True, exclude_none=True)
    write_text(path, tomli_w.dumps(table))
