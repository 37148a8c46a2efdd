"""Several networks of one shape trained in one go, each with draws of its own left out."""

import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.func import functional_call, stack_module_state, vmap

from .training import DensityNetwork

_CLIP = 5.0
_WARM_UP = 0.05
# Draws scored at a time.
_CHUNK = 2000


@dataclass(frozen=True)
class Schedule:
    """How an ensemble is trained.

    Args:
        learning_rate: the peak; it rises over the first twentieth of the steps and falls as a cosine.
        weight_decay: of AdamW, at the peak.
        batch: draws a step and member.
        epochs: at most.
        patience: epochs without any member getting better on what it left out.
    """

    learning_rate: float
    weight_decay: float
    batch: int
    epochs: int
    patience: int


class _Scored(nn.Module):
    """A density network whose call is its log density, which is what torch.func wants."""

    def __init__(self, network: DensityNetwork) -> None:
        super().__init__()
        self.network = network

    def forward(self, z: Tensor, *inputs: Tensor) -> Tensor:
        return self.network.log_prob(inputs, z)


def left_out(draws: int, members: int, share: float, generator: torch.Generator) -> Tensor:
    """``(members, draws)`` bool: disjoint sets, one a member, of ``share`` of the draws at most."""
    size = max(1, int(draws * min(share, 1.0 / members)))
    order = torch.randperm(draws, generator=generator)
    held = torch.zeros(members, draws, dtype=torch.bool)
    for k in range(members):
        held[k, order[k * size : (k + 1) * size]] = True
    return held


def train_ensemble(
    members: Sequence[DensityNetwork],
    inputs: Sequence[Tensor],
    z: Tensor,
    weights: Tensor,
    held: Tensor,
    schedule: Schedule,
    generator: torch.Generator,
    device: torch.device,
) -> Tensor:
    """Train in place, all members at once by batched operations; each ends as it was when it was best on its own set.

    What starts best stays as it started: the state before the first step counts.

    Args:
        members: E networks of one shape.
        inputs: tensors whose first two axes are the members and the draws; each member may read what others do not.
        z: ``(E, N, D)`` targets.
        weights: ``(N,)``.
        held: ``(E, N)`` of :func:`left_out`: as many for every member.
        schedule: how.
        generator: source of the order of the draws, on the CPU whatever the device.
        device: where.

    Returns:
        ``(N,)`` log density of every draw under the member that left it out; NaN where none did.
    """
    stack = _Stack(members, [t.to(device) for t in inputs], z.to(device), device)
    kept = torch.stack([torch.nonzero(~h).flatten() for h in held])
    test = torch.stack([torch.nonzero(h).flatten() for h in held])
    weights = weights.to(device)
    mass = weights[test] / weights[test].sum(1, keepdim=True).clamp(min=1e-12)

    def score() -> Tensor:
        return (stack.score(test) * mass).sum(1)

    batch = min(schedule.batch, kept.shape[1])
    steps = kept.shape[1] // batch
    optimiser = torch.optim.AdamW(stack.parameters, schedule.learning_rate, weight_decay=schedule.weight_decay)
    best, waited, done = score(), 0, 0
    state = stack.snapshot()
    for _ in range(schedule.epochs):
        order = torch.stack([row[torch.randperm(len(row), generator=generator)] for row in kept])
        for step in range(steps):
            rows = order[:, step * batch : (step + 1) * batch]
            for group in optimiser.param_groups:
                group["lr"] = schedule.learning_rate * _rate(done / (schedule.epochs * steps))
            loss = -(weights[rows] * stack.log_prob(rows)).mean(1).sum()
            optimiser.zero_grad()
            torch.autograd.backward(loss)
            stack.clip()
            optimiser.step()
            done += 1
        now = score()
        better = now > best
        waited = 0 if bool(better.any()) else waited + 1
        best = torch.where(better, now, best)
        stack.keep(state, better)
        if waited >= schedule.patience:
            break
    stack.restore(state)
    scores = torch.full((z.shape[1],), torch.nan)
    scores[test] = stack.score(test).cpu()
    for k, member in enumerate(members):
        stack.write(k, member)
    return scores


def _rate(part: float) -> float:
    """Learning rate at a part of all steps, in parts of the peak."""
    return min(1.0, 0.02 + part / _WARM_UP) * 0.5 * (1.0 + math.cos(math.pi * part))


class _Stack:
    """The members' parameters, inputs and targets, with the members as leading axis."""

    def __init__(
        self, members: Sequence[DensityNetwork], inputs: list[Tensor], z: Tensor, device: torch.device
    ) -> None:
        self.inputs, self.z = inputs, z
        scored = [_Scored(m).to(device) for m in members]
        stacked, self.buffers = stack_module_state(scored)
        self.named: dict[str, Tensor] = {k: v.detach().clone().requires_grad_(True) for k, v in stacked.items()}
        self.parameters = list(self.named.values())
        base = copy.deepcopy(scored[0]).to("meta")

        def one(p: dict[str, Tensor], b: dict[str, Any], z: Tensor, *given: Tensor) -> Tensor:
            value: Tensor = functional_call(base, (p, b), (z, *given))
            return value

        self.call: Callable[..., Tensor] = vmap(one)

    def log_prob(self, rows: Tensor) -> Tensor:
        """``(E, B)`` log densities of draws ``rows (E, B)``."""
        member = torch.arange(len(rows))[:, None]
        return self.call(self.named, self.buffers, self.z[member, rows], *[t[member, rows] for t in self.inputs])

    def score(self, rows: Tensor) -> Tensor:
        with torch.no_grad():
            return torch.cat([self.log_prob(part) for part in torch.split(rows, _CHUNK, dim=1)], dim=1)

    def clip(self) -> None:
        """Each member's gradient to a norm of at most five, and to zero where it is not a number."""
        with torch.no_grad():
            norm = sum(
                ((p.grad.flatten(1) ** 2).sum(1) for p in self.parameters if p.grad is not None), torch.zeros(())
            )
            factor = (_CLIP / norm.sqrt().clamp(min=1e-6)).clamp(max=1.0)
            for p in self.parameters:
                if p.grad is not None:
                    p.grad.mul_(factor.reshape(-1, *[1] * (p.dim() - 1))).nan_to_num_(0.0, 0.0, 0.0)

    def snapshot(self) -> dict[str, Tensor]:
        return {k: v.detach().clone() for k, v in self.named.items()}

    def keep(self, state: dict[str, Tensor], better: Tensor) -> None:
        for k, v in self.named.items():
            state[k][better] = v.detach()[better]

    def restore(self, state: dict[str, Tensor]) -> None:
        with torch.no_grad():
            for k, v in self.named.items():
                v.copy_(state[k])

    def write(self, k: int, member: DensityNetwork) -> None:
        """Member k's parameters into its network, on the CPU."""
        member.cpu()
        prefix = "network."
        with torch.no_grad():
            for name, p in member.named_parameters():
                p.copy_(self.named[prefix + name][k].cpu())
