"""What makes the numbers of a fit doubtful, found out with a few more rollouts."""

from ...core.arrays import FloatArray
from ...core.differences import fourth_differences, robust_sd
from ...core.parameters import ParameterSpace
from ...core.rollout import Trajectory
from ...core.study import SimulationPool, Task
from ..noise import Noise
from ..roughness import roughness, unrepeatable


def doubts(pool: SimulationPool, space: ParameterSpace, unit: FloatArray, noise: Noise) -> list[str]:
    """Sentences for people; empty if nothing is doubtful.

    What a rollout does by chance tells nothing of the parameters. A motion that is rough at the frame rate passes for
    noise where the noise is estimated from roughness.
    """
    problem = pool.problem
    values = space.as_dict(space.from_unit(unit))
    plain = next(iter(pool.map([Task(values, problem.fit_on[0])])))
    if not isinstance(plain, Trajectory):
        return [f"the best fit cannot be simulated: {plain.reason}"]
    out: list[str] = []
    rough = roughness(pool, space, unit, problem.fit_on)
    if failing := [n for n in problem.fit_on if n not in rough.sd]:
        out.append(f"close to the best fit {', '.join(failing)} cannot be simulated, so ± means little")
    if loose := unrepeatable(rough, problem.recordings, noise):
        out.append(
            "the simulation is chaotic: next to nothing in the parameters moves "
            + "; ".join(loose)
            + "; what it does there is chance and does not count. Where chance does not decide in reality, "
            "set [material] damping_time = 0.005 or lower [simulator] time_step"
        )
    if noise.source.startswith("roughness"):
        own = robust_sd(fourth_differences(plain.series.points))
        if own > 0.5 * noise.sd:
            out.append(
                "the motion is fast for the frame rate and passes for noise, which is overestimated; "
                f"give it: [noise] sd = ... in {'metres' if noise.unit == 'm' else 'pixels'}, or record repeats"
            )
    return out
