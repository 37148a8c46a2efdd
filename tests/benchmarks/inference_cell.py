"""One cell of the table: train one method on one task's simulations, and hold its posteriors against the known ones.

A cell runs in a process of its own, so that it can be stopped, and on one thread, so that its processor seconds mean
the same whatever runs beside it.
"""

import os
import tempfile
import time
import warnings
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection

import torch
from inference_tasks import KnownTask
from sbi.inference import NPE_C
from sbibm.metrics import c2st
from torch import Tensor

from muslin.core.errors import MuslinError
from muslin.core.registry import REGISTRY

#: Name in the table -> density net of sbi's NPE-C; all else as sbi has it.
RIVALS = {"sbi-mdn": "mdn", "sbi-maf": "maf", "sbi-nsf": "nsf"}

# All of an estimator's code is here before the first cell starts: what is edited during a run has no part in it.
for _name in REGISTRY.names("estimator"):
    with suppress(MuslinError):
        REGISTRY.get("estimator", _name)

#: ``(observation (1, n), count)`` to ``(count, D)`` posterior samples.
Sampler = Callable[[Tensor, int], Tensor]


@dataclass(frozen=True)
class Cell:
    """What to run.

    Args:
        row: task, of :data:`~inference_tasks.ROWS`.
        simulations: draws to train on.
        seed: of the simulations and of the method.
        method: of :data:`RIVALS`, or an estimator of muslin's.
        observations: numbers of 1 to 10.
        samples: of each posterior.
        limit: wall time [s] of it all.
        sampling_limit: wall time [s] of one observation's samples.
    """

    row: str
    simulations: int
    seed: int
    method: str
    observations: tuple[int, ...]
    samples: int
    limit: float
    sampling_limit: float


@dataclass(frozen=True)
class Outcome:
    """What came out. ``c2st`` is NaN-free: an observation without samples is None, and ``note`` says why."""

    c2st: tuple[float | None, ...] = ()
    train_cpu: float | None = None
    train_wall: float | None = None
    sample_wall: float | None = None
    note: str = ""


def train_sbi(net: str, task: KnownTask, theta: Tensor, x: Tensor, seed: int, limit: float) -> Sampler:
    """sbi's NPE-C as it comes: one round, amortised. Its samples are those of the net that lie within the prior."""
    torch.manual_seed(seed)
    inference = NPE_C(task.prior, density_estimator=net, show_progress_bars=False)
    posterior = inference.build_posterior(inference.append_simulations(theta, x).train())
    return lambda observed, count: posterior.sample(
        (count,), x=observed, show_progress_bars=False, max_sampling_time=limit
    )


def train_muslin(name: str, task: KnownTask, theta: Tensor, x: Tensor, seed: int) -> Sampler:
    """An estimator of muslin's with its defaults."""
    import numpy as np

    estimator = REGISTRY.get("estimator", name)(correspondence=task.correspondence)
    estimator.fit(task.to_unit(theta), [task.recording(x)], seed=seed)

    def sample(observed: Tensor, count: int) -> Tensor:
        posterior = estimator.posterior([task.recording(observed)[0]])
        return task.from_unit(posterior.sample(count, np.random.default_rng(seed)))

    return sample


def run(cell: Cell) -> Outcome:
    """Train, sample, compare.

    Training seconds hold everything up to the posterior being ready, but no import and no first step of an optimiser.
    """
    task = KnownTask(cell.row)
    theta, x = task.simulate(cell.simulations, cell.seed)
    _first_step()
    cpu, wall = time.process_time(), time.perf_counter()
    try:
        if cell.method in RIVALS:
            sampler = train_sbi(RIVALS[cell.method], task, theta, x, cell.seed, cell.sampling_limit)
        else:
            sampler = train_muslin(cell.method, task, theta, x, cell.seed)
    except MuslinError as error:
        return Outcome(note=f"does not fit the task: {error}")
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    scores: list[float | None] = []
    note, spent = "", 0.0
    for number in cell.observations:
        began = time.perf_counter()
        try:
            samples = sampler(task.observation(number), cell.samples)
        except RuntimeError as error:  # sbi's way of saying that nearly all of its samples lie outside the prior
            if "max_sampling_time" not in str(error):
                raise
            scores.append(None)
            note = f"rejection sampling took over {cell.sampling_limit:g} s for an observation"
            continue
        spent += time.perf_counter() - began
        scores.append(float(c2st(task.reference(number, cell.samples), samples)))
    return Outcome(tuple(scores), cpu, wall, spent / max(1, sum(s is not None for s in scores)), note)


def _first_step() -> None:
    """What torch loads at the first step of an optimiser is no one's training."""
    weight = torch.zeros(1, requires_grad=True)
    weight.sum().backward()
    torch.optim.Adam([weight]).step()


def work(cell: Cell, answer: Connection) -> None:
    """Run a cell in this process and send what came out, or why nothing did."""
    torch.set_num_threads(1)
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder, open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):
        os.chdir(folder)  # sbi writes its logs to where it runs, and its progress to the terminal
        try:
            outcome = run(cell)
        except Exception as error:
            outcome = Outcome(note=f"{type(error).__name__}: {error}".splitlines()[0])
        os.chdir("/")
    answer.send(asdict(outcome))
