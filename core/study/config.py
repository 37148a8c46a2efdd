"""The study file: one TOML table a topic, every key checked."""

import tomllib
from pathlib import Path
from typing import Any, Literal

import numpy as np
import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from ..errors import InputError, MissingFileError
from ..obstacles import Cylinder, Table
from ..registry import nearest
from ..store import write_text


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class _OpenTable(BaseModel):
    model_config = ConfigDict(extra="allow", allow_inf_nan=False)

    name: str

    @property
    def options(self) -> dict[str, Any]:
        """Options of the plugin itself: every key that muslin does not know."""
        return dict(self.model_extra or {})


class StudyTable(_Table):
    """``[study]``: what is fitted on what."""

    measurement: str
    fit_on: list[str] | None = None
    hold_out: list[str] = Field(default_factory=list)
    results: str | None = None
    seed: int = Field(default=0, ge=0)


class TableTable(_Table):
    """An obstacle ``{ kind = "table", ... }``: see :class:`~muslin.core.obstacles.Table`."""

    kind: Literal["table"]
    height: float
    friction: float = Field(default=1.0, ge=0)

    def build(self) -> Table:
        return Table(self.height, self.friction)


class CylinderTable(_Table):
    """An obstacle ``{ kind = "cylinder", ... }``: see :class:`~muslin.core.obstacles.Cylinder`."""

    kind: Literal["cylinder"]
    center: tuple[float, float, float]
    axis: tuple[float, float, float]
    radius: float = Field(gt=0)
    length: float = Field(gt=0)
    friction: float = Field(default=1.0, ge=0)

    def build(self) -> Cylinder:
        return Cylinder(np.array(self.center), np.array(self.axis), self.radius, self.length, self.friction)


class ScenarioTable(_Table):
    """``[scenario]``: the object and how it is held; every key but the name overrides a built-in."""

    name: str
    size: list[float] | None = None
    vertices: list[int] | None = None
    grasps: list[list[int]] | None = None
    markers: list[int] | Literal["all", "bound"] | None = None
    points: list[int] | None = None
    settle: float | None = Field(default=None, ge=0)
    obstacles: list[TableTable | CylinderTable] | None = None


class EstimatorTable(_OpenTable):
    """``[estimator]``: which one, how many rounds, how many simulated draws a round."""

    rounds: int = Field(default=2, ge=1)
    draws: int = Field(default=120, ge=10)


class ParameterTable(_Table):
    """``[parameters.NAME]``: bounds of a uniform prior."""

    low: float
    high: float
    scale: Literal["linear", "log"] = "linear"
    unit: str | None = None


class NoiseTable(_Table):
    """``[noise]``: standard deviation of the measurement, if it is known."""

    sd: float | None = Field(default=None, gt=0)


class NuisanceTable(_Table):
    """``[nuisance]``: prior standard deviations of what may be off in the measurement itself."""

    clock_offset: float = Field(default=0.0, ge=0)
    constant_offset: float = Field(default=0.0, ge=0)


class DiagnoseTable(_Table):
    """``[diagnose]``: which effects to try."""

    candidates: list[str] | None = None
    draws: int = Field(default=16, ge=2)


class StudyConfig(_Table):
    """A whole study file."""

    study: StudyTable
    scenario: ScenarioTable
    simulator: _OpenTable
    extractor: _OpenTable = Field(default_factory=lambda: _OpenTable(name="markers"))
    estimator: EstimatorTable = Field(default_factory=lambda: EstimatorTable(name="bayessim-rkhs"))
    material: dict[str, float] = Field(default_factory=dict)
    parameters: dict[str, ParameterTable] = Field(default_factory=dict)
    effects: dict[str, dict[str, float | ParameterTable]] = Field(default_factory=dict)
    noise: NoiseTable = Field(default_factory=NoiseTable)
    nuisance: NuisanceTable = Field(default_factory=NuisanceTable)
    diagnose: DiagnoseTable = Field(default_factory=DiagnoseTable)

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
            elif e["type"] == "missing":
                lines.append(f"[{place}] is missing")
            else:
                got = "" if isinstance(e["input"], dict) else f"; got {e['input']!r:.80}"
                lines.append(f"[{place}] {e['msg'].removeprefix('Value error, ')}{got}")
        raise InputError(f"{where}: " + "; ".join(lines)) from error


def _known_keys(loc: tuple[int | str, ...]) -> list[str]:
    model: Any = StudyConfig
    for part in loc[:-1]:
        field = getattr(model, "model_fields", {}).get(str(part))
        model = field.annotation if field is not None else ParameterTable
    return list(getattr(model, "model_fields", StudyConfig.model_fields))


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
