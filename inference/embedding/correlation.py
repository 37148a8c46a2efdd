"""BayesSim's summary of a trajectory: how its differences go with the actions, their mean and variance."""

import torch
from torch import Tensor

from ...core.arrays import FloatArray
from ...core.errors import InputError
from .rows import Rows, TrajectoryRows


class CorrelationRows(Rows):
    """``phi(S, A) = ({<tau_i, a_j>}_ij, E[tau], Var[tau])`` with ``tau_t = s_{t+1} - s_t`` (BayesSim, Ramos 2019).

    The state s_t is the coordinates of all points of a frame; the inner product, mean and variance are over time.
    Estimators see recordings and no commands. All draws share the command, so the actions a_t are taken to be the
    mean motion that they share: the differences over time of the centre of each frame, over draws and points (the
    mean that standardising takes off), scaled to a root mean square of one.

    Args:
        trajectory: where the coordinates come from.

    Raises:
        InputError: a recording of one frame, which has no differences.
    """

    def __init__(self, trajectory: TrajectoryRows) -> None:
        self.trajectory = trajectory
        self.actions = []
        for r, scaler in enumerate(trajectory.encoder.scalers):
            center = torch.tensor(scaler.center[:, 0] / scaler.scale)
            if len(center) < 2:
                raise InputError(
                    f'recording {r} has one frame, but on="summaries" needs differences between frames; '
                    'use on="trajectory"'
                )
            motion = center.diff(dim=0)
            self.actions.append((motion, motion / motion.square().mean().sqrt().clamp(min=1e-12)))

    def __call__(self, x: list[FloatArray]) -> list[Tensor]:
        rows = []
        for z, (motion, actions) in zip(self.trajectory.coordinates(x), self.actions, strict=True):
            # Standardising took the shared motion off; the state's differences have it.
            tau = z.diff(dim=1) + motion[:, None, :]
            products = torch.einsum("ntpa,tb->npab", tau, actions) / len(actions)
            variance = tau.var(dim=1, correction=0)
            rows += [products.flatten(1), tau.mean(1).flatten(1), variance.flatten(1)]
        return [torch.cat(rows, dim=1)]
