"""Residuals of a model that is held to the recordings, with a law in place of the estimated force."""

from ....core.parameters import ParameterSpace
from ...polish import Objective
from .estimate import ForceObjective
from .field import PULL


def held_objective(force: ForceObjective, space: ParameterSpace) -> Objective:
    """White residuals as a function of parameters and the coefficients of a law, under the pull of the estimate.

    A model left to itself loses the recording wherever the guess is not good yet, and a least-squares search gets
    stuck there; held, its residuals answer nearly linearly.

    Args:
        force: the objective of the force, whose pull is used.
        space: parameters and coefficients, as ``law.NAME``.
    """
    u = force.unknowns
    pulls = {r: {f"{e}.{PULL}": p} for r, e, p in zip(u.recordings, u.effects, u.pulls, strict=True)}
    return Objective(
        force.pool, space, u.recordings, force.noise, force.offsets, given=pulls, discrepancy=force.discrepancy
    )
