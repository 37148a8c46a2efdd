"""What goes into a new study file."""

from dataclasses import dataclass
from typing import Any

from ..core.obstacles import Table
from ..core.parameters import Parameter
from ..core.scenarios import preset
from ..core.scenarios.measured import MEASURED_PRIORS


@dataclass(frozen=True)
class Plan:
    """What goes into a new study file.

    Args:
        measurement: path of the store, relative to the study file.
        fit_on, hold_out: names of recordings.
        scenario, simulator, estimator: names.
        kind: of the object.
        held: for every gripper the vertices that it holds.
        size: of the object [m]; empty for a mesh.
        vertices: counts along the same axes; of a mesh empty, but for a rope.
        mesh: file with the object, relative to the study file, or None for a built-in one.
        mesh_scale: of its coordinates.
        grasp_points: where each gripper holds it, None for where the scenario says.
        points: measured points to compare, None for all.
        markers: where they sit: ``"all"``, ``"bound"``, vertex numbers; None while undecided.
        extractor: name and options of what found the points in pictures, or None where they were measured.
        start: ``"measured"`` where a rope starts through its markers, which then tell its length and where they sit.
        spacing: ``"measured"`` where the markers sit as far apart as they are seen, not where their vertices are.
        time_step: of the simulator [s], None for the usual one.
        frame: in which axes the object is given, None for the usual ones.
        grasps: for every gripper the vertices that it holds, None for those that the scenario or ``grasp_points`` say.
        marker_points: where the markers sit on a flat sheet [m], None for where ``markers`` says.
        obstacles: what stands around the object, none for what the scenario has.
        near: how near the model is meant to come [m], None for as near as the noise lets it.
        window: length of the pieces that are fitted [s], None for whole recordings.
    """

    measurement: str
    fit_on: list[str]
    hold_out: list[str]
    scenario: str
    simulator: str
    estimator: str
    kind: str
    held: list[list[int]]
    size: list[float]
    vertices: list[int]
    mesh: str | None
    mesh_scale: float
    grasp_points: list[list[float]] | None
    points: list[int] | None
    markers: str | list[int] | None
    extractor: dict[str, Any] | None = None
    start: str | None = None
    spacing: str | None = None
    time_step: float | None = None
    frame: str | None = None
    grasps: list[list[int]] | None = None
    marker_points: list[list[float]] | None = None
    obstacles: tuple[Table, ...] = ()
    near: float | None = None
    window: float | None = None

    @property
    def priors(self) -> tuple[Parameter, ...]:
        """What is inferred."""
        return MEASURED_PRIORS if self.start else preset(self.scenario).default_priors(self.kind)
