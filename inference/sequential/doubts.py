"""What makes the numbers of a fit doubtful, found out with two more rollouts."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.parameters import ParameterSpace
from ...core.rollout import Trajectory
from ...core.study import SimulationPool, Task
from ..noise import Noise

#: A change of the parameters this small [relative] must not be seen in the prediction.
NUDGE = 1e-9


def doubts(pool: SimulationPool, space: ParameterSpace, unit: FloatArray, recording: str, noise: Noise) -> list[str]:
    """Sentences for people; empty if nothing is doubtful.

    A chaotic rollout has no derivative to speak of, and neither best fit nor standard deviation mean
    much. A motion that is rough at the frame rate passes for noise where the noise is estimated from
    roughness.
    """
    values = space.as_dict(space.from_unit(unit))
    nudged = {name: value * (1 + NUDGE) for name, value in values.items()}
    plain, moved = pool.map([Task(values, recording), Task(nudged, recording)])
    out: list[str] = []
    for what, outcome in (("the best fit", plain), ("the best fit, moved by one part in 10^9,", moved)):
        if not isinstance(outcome, Trajectory):
            return [f"{what} cannot be simulated: {outcome.reason}"]
    assert isinstance(plain, Trajectory) and isinstance(moved, Trajectory)
    shift = float(np.sqrt(np.mean((plain.series.points - moved.series.points) ** 2)))
    if shift > 0.3 * noise.sd:
        out.append(
            f"the simulation is chaotic: changing the parameters by one part in 10^9 moves it by {1e3 * shift:.1f} mm, "
            "so ± means little; set [material] damping_time = 0.005 or lower [simulator] time_step"
        )
    if noise.source.startswith("roughness"):
        rough = np.diff(plain.series.points, n=4, axis=0) / np.sqrt(70.0)
        own = float(1.4826 * np.median(np.abs(rough)))
        if own > 0.5 * noise.sd:
            out.append(
                "the motion is fast for the frame rate and passes for noise, which is overestimated; "
                "give it: [noise] sd = ... in metres, or record repeats"
            )
    return out
