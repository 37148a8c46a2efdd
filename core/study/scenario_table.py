"""The table ``[scenario]`` of a study file."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from ..importing.mesh import read_closed_surface
from ..obstacles import Cylinder, StaticMesh, Table

#: x, y, z [m].
Point = tuple[float, float, float]


class StrictTable(BaseModel):
    """A table that takes the keys it knows, and finite numbers."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class TableTable(StrictTable):
    """An obstacle ``{ kind = "table", ... }``: see :class:`~muslin.core.obstacles.Table`."""

    kind: Literal["table"]
    height: float
    friction: float = Field(default=1.0, ge=0)

    def build(self, folder: Path) -> Table:
        return Table(self.height, self.friction)


class CylinderTable(StrictTable):
    """An obstacle ``{ kind = "cylinder", ... }``: see :class:`~muslin.core.obstacles.Cylinder`."""

    kind: Literal["cylinder"]
    center: Point
    axis: Point
    radius: float = Field(gt=0)
    length: float = Field(gt=0)
    friction: float = Field(default=1.0, ge=0)

    def build(self, folder: Path) -> Cylinder:
        return Cylinder(np.array(self.center), np.array(self.axis), self.radius, self.length, self.friction)


class MeshTable(StrictTable):
    """An obstacle ``{ kind = "mesh", ... }``: see :class:`~muslin.core.obstacles.StaticMesh`."""

    kind: Literal["mesh"]
    file: str
    scale: float = Field(default=1.0, gt=0)
    up: Literal["x", "y", "z"] = "z"
    position: Point = (0.0, 0.0, 0.0)
    friction: float = Field(default=1.0, ge=0)

    def build(self, folder: Path) -> StaticMesh:
        vertices, triangles = read_closed_surface(folder / self.file, self.scale, self.up)
        return StaticMesh(vertices + np.array(self.position), triangles, self.friction)


#: Kinds of obstacles.
OBSTACLES = ("table", "cylinder", "mesh")
ObstacleTable = Annotated[TableTable | CylinderTable | MeshTable, Field(discriminator="kind")]


class ScenarioTable(StrictTable):
    """``[scenario]``: the object and how it is held; every key but the name overrides a built-in.

    ``mesh`` is an object of the user's own: see :func:`~muslin.core.importing.mesh.read_body`. ``frame`` says in which
    axes the object and ``grasp_points`` are given: ``"gripper"``: those of the first gripper at its first pose;
    ``"upright"``: from the first gripper's first position along the axes of the world; ``"world"``: as it stands in
    the world at the start; ``"markers"``: in axes of its own, laid under the markers of the first frame of each take
    and bent as they are, see :func:`~muslin.core.scenarios.laid.laid_under`. ``marker_points`` are where the markers
    sit on a flat cloth, in the same axes as ``grasp_points``. ``start = "measured"`` lets a rope start through the
    markers of the first frame, at once, and says where they are on it: its length, and so its mass, follow from each
    take. With ``markers = "beside"`` these stand beside the axis of the rope, see
    :func:`~muslin.core.scenarios.standoffs.told_standoffs`. With ``spacing = "measured"`` the markers of a flat cloth
    sit as far apart as the recordings that are fitted show, near where ``markers`` says, see
    :func:`~muslin.core.scenarios.spacing.told_places`.
    """

    name: str
    size: list[float] | None = None
    vertices: list[int] | None = None
    mesh: str | None = None
    mesh_scale: float = Field(default=1.0, gt=0)
    mesh_up: Literal["x", "y", "z"] = "z"
    straight_rest: bool = False
    frame: Literal["gripper", "upright", "world", "markers"] = "gripper"
    grasps: list[list[int]] | None = None
    grasp_points: list[Point | list[Point]] | None = None
    grasp_radius: float = Field(default=0.0, ge=0)
    start: Literal["measured"] | None = None
    markers: list[int] | Literal["all", "bound", "surface", "beside"] | None = None
    marker_points: list[Point] | None = None
    spacing: Literal["measured"] | None = None
    points: list[int] | None = None
    settle: float | None = Field(default=None, ge=0)
    obstacles: list[ObstacleTable] | None = None

    @property
    def files(self) -> list[str]:
        """The meshes that it names, as they are written."""
        meshes = [o.file for o in self.obstacles or [] if isinstance(o, MeshTable)]
        return [*([self.mesh] if self.mesh is not None else []), *meshes]

    def move_files(self, to: Callable[[str], str]) -> None:
        """Name every mesh anew."""
        if self.mesh is not None:
            self.mesh = to(self.mesh)
        for obstacle in self.obstacles or []:
            if isinstance(obstacle, MeshTable):
                obstacle.file = to(obstacle.file)

    @model_validator(mode="after")
    def _one_object(self) -> "ScenarioTable":
        if self.mesh is None:
            for key in ("mesh_scale", "mesh_up", "straight_rest"):
                if key in self.model_fields_set:
                    raise ValueError(f"{key} says how to take a mesh, but there is none; add mesh = 'FILE'")
        elif self.size is not None:
            raise ValueError("size does not go with a mesh, which has one of its own; use mesh_scale")
        if self.grasps is not None and self.grasp_points is not None:
            raise ValueError("grasps and grasp_points both say what is held; keep one of them")
        if self.markers is not None and self.marker_points is not None:
            raise ValueError("markers and marker_points both say where the markers sit; keep one of them")
        if self.start is not None:
            self._only_measured()
        elif self.markers == "beside":
            raise ValueError("markers = 'beside' is for a rope that starts as measured; add start = 'measured'")
        if self.spacing is not None and self.markers in ("bound", "surface", "beside"):
            raise ValueError(
                f"spacing = 'measured' moves markers that sit on vertices, not markers = {self.markers!r}; keep one of "
                "the two"
            )
        if self.frame == "markers" and self.markers in ("bound", "surface"):
            raise ValueError(
                f"frame = 'markers' lays the object under markers that sit on its vertices, not under markers = "
                f"{self.markers!r}; keep one of the two"
            )
        if self.grasp_points is None and "grasp_radius" in self.model_fields_set:
            raise ValueError("grasp_radius goes with grasp_points, which are missing")
        return self

    def _only_measured(self) -> None:
        """What the first frame tells is not told here too: it would be ignored."""
        told = [k for k in ("mesh", "size") if getattr(self, k) is not None]
        told += ["markers"] if self.markers not in (None, "beside") else []
        told += ["marker_points"] if self.marker_points is not None else []
        told += ["spacing"] if self.spacing is not None else []
        told += ["frame"] if self.frame != "gripper" else []
        if told:
            raise ValueError(
                "start = 'measured' takes the rope, its length and its markers from the first frame of each take; "
                f"leave {', '.join(told)} out"
            )
        if self.grasp_points is not None:
            raise ValueError("start = 'measured' has no place for grasp_points; name the held vertices with grasps")
        if self.settle:
            raise ValueError(
                f"start = 'measured' starts where the rope was seen, but settle = {self.settle:g} s would take it away "
                "from there; leave settle out"
            )
