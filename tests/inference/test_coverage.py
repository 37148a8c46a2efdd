"""Do intervals hold what they promise where draws are few and long and the parameters act very unevenly?"""

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.registry import REGISTRY

torch = pytest.importorskip("torch")

from muslin.inference.density.members import Plan, cross_fit  # noqa: E402

TIME, POINT, AXIS = np.ogrid[0:1:16j, 0:1:8j, 0:3]


def simulate(theta: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Two parameters over decades, 384 numbers; the second moves them the less the larger it is."""
    stiff, limp = np.exp(3.0 * theta[:, 0])[:, None, None, None], np.exp(-4.0 * theta[:, 1])[:, None, None, None]
    swing = np.sin(4.0 * TIME * (1.0 + 0.3 * np.log(stiff)) + POINT + 2.0 * AXIS) + 0.5 * TIME / stiff
    ripple = 0.4 * limp * np.sin(12.0 * TIME * (1.0 + limp) + 5.0 * POINT * AXIS)
    return np.asarray(swing + ripple + 0.1 * rng.standard_normal((len(theta), 16, 8, 3)))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bayessim-rkhs", "bayessim-mdnn", "npe-rkhs"])
def test_intervals_hold_what_they_promise(name: str) -> None:
    """Three trainings on 120 draws each, their central 80 % intervals held against 60 fresh draws each."""
    held = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        theta, truth = rng.random((120, 2)), rng.random((60, 2))
        estimator = REGISTRY.get("estimator", name)()
        estimator.fit(theta, [simulate(theta, rng)], seed=seed)
        for x, t in zip(simulate(truth, rng), truth, strict=True):
            rank = (estimator.posterior([x]).sample(200, rng) < t).mean(axis=0)
            held.append(np.abs(rank - 0.5) < 0.4)
    share = np.mean(held, axis=0)
    assert ((share > 0.7) & (share < 0.92)).all(), (
        f"80 % intervals hold the truth in {(100 * share).round()} % of cases"
    )


class Remembers:
    """A summary that tells the parameters of draws it has been shown, and nothing of others."""

    def __init__(self, known: list[torch.Tensor], latent: torch.Tensor) -> None:
        self.numbers, self.latent = known[0][:, 0].long().tolist(), latent
        self.training = self(known)
        self.residual = torch.ones(latent.shape[1])

    def __call__(self, known: list[torch.Tensor], /) -> tuple[torch.Tensor, torch.Tensor]:
        rows = [self.numbers.index(n) if n in self.numbers else None for n in known[0][:, 0].long().tolist()]
        told = torch.stack([torch.zeros(self.latent.shape[1]) if r is None else self.latent[r].float() for r in rows])
        return told, torch.zeros_like(told)


def test_nothing_that_networks_read_was_made_with_the_draws_they_leave_out() -> None:
    from muslin.inference.density.draws import Draws
    from muslin.inference.density.mixture_head import MixtureHead

    theta = np.random.default_rng(0).random((40, 2))
    draws = Draws.of(theta, np.ones(40))
    with torch.random.fork_rng():
        members = cross_fit(
            lambda summary: MixtureHead(4, 2, 2, summary.residual),
            lambda known, some: Remembers(known, some.latent),
            [torch.arange(40.0)[:, None]],
            draws,
            draws.latent,
            Plan((4,), 4, 1e-3, 0.0, 16, 2, 2),
            torch.Generator().manual_seed(0),
        )
    assert all((member.inputs[0] == 0).all() for member in members)
    times = torch.zeros(40)
    for member in members:
        times[member.held] += 1
    assert (times == 2).all()
