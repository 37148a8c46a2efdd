"""The three scenarios of the paper's protocol: what is inferred, what the model is, and what stands for reality."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.camera import Camera
from muslin.core.material import Material
from muslin.core.obstacles import Table
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.registry import REGISTRY
from muslin.core.rollout import Trajectory, rollout
from muslin.core.scenario import STANDARD_GRAVITY, Scenario
from muslin.core.scenarios import preset
from muslin.core.scenarios.motions import smooth_path
from muslin.core.scene import Scene
from muslin.core.study import Problem

#: Rate at which keypoints are seen [Hz].
RATE = 10.0
#: Seconds of computation after which a draw is given up.
TIME_LIMIT = 30.0
#: How much larger or smaller than the model's mesh the object may be.
SCALE = Parameter("scale", "1", 0.8, 1.2, "linear", "size of the object over that of the model")

Reality = Literal["same", "other"]
MODEL, OTHER = "mujoco", "pybullet"


def _fling(counts: tuple[int, ...]) -> Scenario:
    """The paper's: up, lowered onto a table, and dragged over it. The preset alone stays in the air."""
    up_and_down = [(0, 0, 0, 1.0), (0.55, 0, 0.22, 1.15), (1.1, 0, -0.066, 1.0)]
    motion = smooth_path([*up_and_down, (1.6, 0, -0.066, 0.68), (2.4, 0, -0.366, 0.68)], 0.2)
    times = np.arange(0.0, motion.times[-1] + 1e-9, 1.0 / RATE)
    return replace(preset("fling").scenario(vertices=counts), motion=motion, times=times, obstacles=(Table(0.6),))


def _wiping(counts: tuple[int, ...]) -> Scenario:
    """Held over the middle quarter of its edge on every mesh; the preset's own grasp goes by thirds of the columns."""
    columns = counts[0] - 1
    return replace(_of_preset("wiping")(counts), grasps=(np.arange(3 * columns // 8, 5 * columns // 8 + 1),))


def _of_preset(name: str) -> Callable[[tuple[int, ...]], Scenario]:
    def made(counts: tuple[int, ...]) -> Scenario:
        scenario = preset(name).scenario(vertices=counts)
        return replace(scenario, times=np.arange(0.0, scenario.times[-1] + 1e-9, 1.0 / RATE))

    return made


@dataclass(frozen=True)
class Setting:
    """One scenario.

    Args:
        name: of it.
        build: the scenario from the vertex counts of its mesh.
        coarse: counts of the model, and of a reality in the same engine.
        fine: counts of the reality in the other engine.
    """

    name: str
    build: Callable[[tuple[int, ...]], Scenario]
    coarse: tuple[int, ...]
    fine: tuple[int, ...]

    @property
    def material(self) -> Material:
        """What the parameters do not say."""
        return preset(self.name).default_material()

    @property
    def space(self) -> ParameterSpace:
        """Bending and stretch stiffness and friction over the scenario's priors, and the size."""
        priors = {p.name: p for p in preset(self.name).default_priors()}
        friction = Parameter("friction", "1", 0.1, 1.0, "linear", "Coulomb coefficient on an obstacle of friction 1")
        kept = (priors["bending_rigidity"], priors["stretch_stiffness"], priors.get("friction", friction))
        return ParameterSpace((*kept, SCALE))

    def scenario(self, reality: Reality | None = None) -> Scenario:
        """The model's scenario, or that of a reality."""
        return self.build(self.fine if reality == "other" else self.coarse)

    def problem(self) -> Problem:
        """What a pool of workers simulates draws of."""
        return Problem(
            recordings={},
            fit_on=(self.name,),
            hold_out=(),
            scenarios={self.name: replace(self.scenario(), name=self.name)},
            simulator=REGISTRY.get("simulator", MODEL)(),
            extractor=REGISTRY.get("extractor", "markers")(),
            material=self.material,
            space=self.space,
            fixed={},
            effects={},
            time_limit=TIME_LIMIT,
        )

    def real(self, unit: FloatArray, reality: Reality) -> Trajectory:
        """What really happens with hidden parameters ``unit (D,)`` of the unit cube."""
        engine = MODEL if reality == "same" else OTHER
        problem = replace(
            self.problem(),
            simulator=REGISTRY.get("simulator", engine)(),
            scenarios={self.name: self.scenario(reality)},
            time_limit=None,
        )
        return problem.simulate(self.space.as_dict(self.space.from_unit(unit)), self.name)

    def scene(self, reality: Reality | None = None) -> Scene:
        """What is drawn around and of the object."""
        return self.scenario(reality).scene(self.material, np.array([0.0, 0.0, -STANDARD_GRAVITY]))

    def camera(self) -> Camera:
        """320 x 320, with room around the object of the middle of the prior."""
        middle = rollout(REGISTRY.get("simulator", MODEL)(), self.scenario(), self.material)
        return Camera.framing(middle.vertices, margin=1.4)


SETTINGS = {
    s.name: s
    for s in (
        Setting("wiping", _wiping, (9, 9), (17, 17)),
        Setting("winding", _of_preset("winding"), (51,), (101,)),
        Setting("fling", _fling, (9, 9), (17, 17)),
    )
}
