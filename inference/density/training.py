"""Training: weights, early stopping, and a run that leaves no trace outside and repeats to the bit."""

import copy
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import torch
from torch import Tensor

from ...core.arrays import FloatArray
from ...core.errors import InputError


class DensityNetwork(torch.nn.Module, ABC):
    """A network that gives the density of its targets."""

    @abstractmethod
    def log_prob(self, inputs: Sequence[Tensor], z: Tensor) -> Tensor:
        """``(B,)`` natural log density of targets ``z (B, D)``, given tensors whose first axis is B."""


@contextmanager
def isolated(seed: int, threads: int) -> Iterator[torch.Generator]:
    """Seeded torch on a fixed number of threads; the caller's generators and threads come back afterwards.

    The order of a sum depends on the number of threads, so results could not repeat to the bit without fixing it.
    """
    before = torch.get_num_threads()
    with torch.random.fork_rng(devices=[]), torch.enable_grad():
        torch.default_generator.manual_seed(seed)
        torch.set_num_threads(threads)
        try:
            yield torch.Generator().manual_seed(seed)
        finally:
            torch.set_num_threads(before)


def importance_weights(log_weights: FloatArray | None, draws: int) -> FloatArray:
    """Self-normalised importance weights ``(N,)`` of mean one, truncated at ``sqrt(N)``.

    Truncating at ``sqrt(N)`` times the mean bounds the variance that a few draws from the tail of the proposal
    would bring, and vanishes as N grows (truncated importance sampling, Ionides 2008).

    Raises:
        InputError: wrong shape, NaN or +inf among them, or no draw with a weight above zero.
    """
    if log_weights is None:
        return np.ones(draws)
    lw = np.asarray(log_weights, float)
    if lw.shape != (draws,):
        raise InputError(f"log_weights has shape {lw.shape}, but there are {draws} draws")
    if np.isnan(lw).any() or (lw == np.inf).any():
        raise InputError("log_weights holds NaN or +inf; a draw that counts for nothing has -inf")
    if not np.isfinite(lw).any():
        raise InputError("every draw has weight zero (log_weights is -inf throughout)")
    weights = np.exp(lw - lw.max())
    weights = np.minimum(weights / weights.mean(), np.sqrt(draws))
    return np.asarray(weights / weights.mean(), float)


def train(
    network: DensityNetwork,
    inputs: Sequence[Tensor],
    z: Tensor,
    weights: Tensor,
    held_out: Tensor,
    generator: torch.Generator,
    *,
    learning_rate: float,
    weight_decay: float,
    batch: int,
    max_epochs: int,
    patience: int,
) -> float:
    """Maximise the weighted log density by Adam; keep the state that was best on the held-out draws.

    Args:
        network: trained in place.
        inputs: tensors whose first axis is the draws.
        z: ``(N, D)`` targets.
        weights: ``(N,)``.
        held_out: ``(N,)`` bool; with none true, all epochs are run and the last state is kept.
        generator: source of the order of the draws.
        learning_rate, weight_decay, batch, max_epochs, patience: of Adam and of the stopping [epochs].

    Returns:
        The held-out mean log density [nats], NaN without held-out draws.
    """
    kept, test = torch.nonzero(~held_out).flatten(), torch.nonzero(held_out).flatten()
    optimiser = torch.optim.Adam(network.parameters(), lr=learning_rate, weight_decay=weight_decay)
    check = [t[test] for t in inputs]

    def held_out_score() -> float:
        with torch.no_grad():
            value = (weights[test] * network.log_prob(check, z[test])).sum() / weights[test].sum()
        return float(value)

    best = held_out_score() if len(test) else float("nan")
    state, waited = copy.deepcopy(network.state_dict()), 0
    for _ in range(max_epochs):
        order = kept[torch.randperm(len(kept), generator=generator)]
        for start in range(0, len(order), batch):
            rows = order[start : start + batch]
            loss = -(weights[rows] * network.log_prob([t[rows] for t in inputs], z[rows])).mean()
            optimiser.zero_grad()
            torch.autograd.backward(loss)
            torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
            optimiser.step()
        if not len(test):
            continue
        score = held_out_score()
        if score > best:
            best, state, waited = score, copy.deepcopy(network.state_dict()), 0
        else:
            waited += 1
            if waited >= patience:
                break
    if len(test):
        network.load_state_dict(state)
    return best
