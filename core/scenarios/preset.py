"""What the name of a built-in scenario stands for."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..arrays import IntArray
from ..body import Body
from ..errors import InputError
from ..material import DEFAULT_PRIORS, MATERIALS, Material, with_fields
from ..motion import Motion
from ..obstacles import Obstacle
from ..parameters import Parameter
from ..scenario import Scenario, StartShape
from .layouts import Counts, Size

#: What the sizes of an object are, and the vertex counts along them, by kind.
SIZES: dict[str, tuple[str, ...]] = {"cloth": ("width", "height"), "rope": ("length",), "solid": ("x", "y", "z")}
#: Vertex counts where sizes of another kind than the scenario's own come without them.
_COUNTS: dict[int, Counts] = {1: (41,), 2: (9, 9), 3: (4, 4, 4)}
#: Rate of the observations of a scenario that no recording gives [Hz], and how long it is where nothing moves [s].
CAMERA_RATE, STILL_DURATION = 30.0, 2.0


@dataclass(frozen=True, eq=False)
class Preset:
    """Every field can be overridden in a study.

    Args:
        name: of the scenario.
        about: what it is, for a person, in a few words.
        kinds: of body that it can be done with; the first is meant where nothing else is said.
        size: of that body, as in :data:`SIZES` [m].
        vertices: counts along the same axes (cloth: columns, rows).
        path: built-in command, used where a recording has none.
        grasps: of the body, vertices a gripper.
        layout: makes the body from sizes and counts.
        load_vertices: where loads hang.
        settle: [s].
        obstacles: what stands around it.
        start: shape that it starts in; None: the rest shape.
        material: fields of the material that differ from its defaults [SI], for the first kind.
        priors: what is inferred where a study does not say; none: the defaults of the material.
    """

    name: str
    about: str
    kinds: tuple[str, ...]
    size: Size
    vertices: Counts
    path: Callable[[Body], Motion]
    grasps: Callable[[Body], tuple[IntArray, ...]]
    layout: Callable[[Size, Counts], Body]
    load_vertices: Callable[[Body], IntArray] = field(default=lambda body: np.zeros(0, np.int64))
    settle: float = 0.0
    obstacles: tuple[Obstacle, ...] = ()
    start: StartShape | None = None
    material: Mapping[str, float] = field(default_factory=dict)
    priors: tuple[Parameter, ...] = ()

    @property
    def kind(self) -> str:
        """Of the body that is meant where nothing else is said."""
        return self.kinds[0]

    def body(self, size: Sequence[float] | None = None, vertices: Sequence[int] | None = None) -> Body:
        """The rest shape; the number of sizes tells the kind.

        Raises:
            InputError: not a size and a count for every axis of a kind that this scenario is for.
        """
        lengths = tuple(size or self.size)
        counts = tuple(vertices or self.counts(lengths))
        if len(lengths) not in [len(SIZES[k]) for k in self.kinds] or len(counts) != len(lengths) or min(lengths) <= 0:
            wanted = " or ".join(
                f"a {k} needs {len(SIZES[k])} positive sizes [m] and {len(SIZES[k])} vertex counts "
                f"({', '.join(SIZES[k])})"
                for k in self.kinds
            )
            raise InputError(f"[scenario]: {wanted}, got size = {list(lengths)} and vertices = {list(counts)}")
        return self.layout(lengths, counts)

    def counts(self, size: Sequence[float]) -> Counts:
        """Vertex counts that go with sizes where nothing else is said."""
        return self.vertices if len(size) == len(self.vertices) else _COUNTS.get(len(size), self.vertices)

    def motion(self, body: Body | None = None) -> Motion:
        """The built-in command for a body; default its own."""
        return self.path(self.body() if body is None else body)

    def default_material(self, kind: str | None = None) -> Material:
        """What the object is made of where a study does not say."""
        its: Material = MATERIALS[kind or self.kind]()
        return with_fields(its, dict(self.material)) if its.kind == self.kind else its

    def default_priors(self, kind: str | None = None) -> tuple[Parameter, ...]:
        """What is inferred where a study does not say."""
        return self.priors if self.priors and kind in (None, self.kind) else DEFAULT_PRIORS[kind or self.kind]

    def scenario(self, size: Sequence[float] | None = None, vertices: Sequence[int] | None = None) -> Scenario:
        """The whole of it under its own command, every vertex a marker, observed at :data:`CAMERA_RATE`."""
        body = self.body(size, vertices)
        motion = self.motion(body)
        return Scenario(
            name=self.name,
            body=body,
            grasps=self.grasps(body),
            motion=motion,
            times=np.arange(0.0, (motion.times[-1] or STILL_DURATION) + 1e-9, 1.0 / CAMERA_RATE),
            markers=np.eye(len(body.vertices)),
            load_vertices=self.load_vertices(body),
            obstacles=self.obstacles,
            start=self.start,
            settle=self.settle,
        )
