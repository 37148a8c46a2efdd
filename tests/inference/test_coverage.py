"""Do intervals hold what they promise where draws are few and long and the parameters act very unevenly?"""

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.registry import REGISTRY

torch = pytest.importorskip("torch")
pytest.importorskip("zuko")

from muslin.inference.density import stacked  # noqa: E402
from muslin.inference.density.draws import Draws  # noqa: E402
from muslin.inference.density.ensemble import Schedule  # noqa: E402
from muslin.inference.density.view import Known, Seen, View  # noqa: E402


def simulate(theta: FloatArray, frames: int, points: int, noise: float, rng: np.random.Generator) -> FloatArray:
    """Two parameters over decades; the second moves the points the less the larger it is."""
    time, point, axis = np.ogrid[0 : 1 : frames * 1j, 0 : 1 : points * 1j, 0:3]
    stiff, limp = np.exp(3.0 * theta[:, 0])[:, None, None, None], np.exp(-4.0 * theta[:, 1])[:, None, None, None]
    swing = np.sin(4.0 * time * (1.0 + 0.3 * np.log(stiff)) + point + 2.0 * axis) + 0.5 * time / stiff
    ripple = 0.4 * limp * np.sin(12.0 * time * (1.0 + limp) + 5.0 * point * axis)
    return np.asarray(swing + ripple + noise * rng.standard_normal((len(theta), frames, points, 3)))


def covered(name: str, frames: int, points: int, noise: float) -> FloatArray:
    """Share of truths that central 80 % intervals hold: three trainings on 64 draws each, 40 fresh draws each."""
    held = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        theta, truth = rng.random((64, 2)), rng.random((40, 2))
        estimator = REGISTRY.get("estimator", name)()
        estimator.fit(theta, [simulate(theta, frames, points, noise, rng)], seed=seed)
        for x, t in zip(simulate(truth, frames, points, noise, rng), truth, strict=True):
            rank = (estimator.posterior([x]).sample(200, rng) < t).mean(axis=0)
            held.append(np.abs(rank - 0.5) < 0.4)
    return np.asarray(np.mean(held, axis=0))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "frames", "points", "noise"), [
    ("npe-rkhs", 16, 8, 0.1),
    ("bayessim-rkhs", 16, 8, 0.1),
    ("bayessim-mdnn", 16, 8, 0.1),
    pytest.param("npe-rkhs", 40, 16, 0.5, marks=pytest.mark.xfail(
        strict=True, reason="64 draws of 1920 noisy numbers: 80 % intervals hold the truth in 62 and 71 % of cases")),
])  # fmt: skip
def test_intervals_hold_what_they_promise(name: str, frames: int, points: int, noise: float) -> None:
    share = covered(name, frames, points, noise)
    assert ((share > 0.7) & (share < 0.92)).all(), (
        f"80 % intervals hold the truth in {(100 * share).round()} % of cases"
    )


def test_nothing_that_a_member_reads_was_made_from_the_draws_it_leaves_out(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[set[float]] = []
    left: list[set[float]] = []

    class Noted(View):
        """Draws are told by the number in their first column."""

        def __init__(self, known: Known, draws: Draws, principal: int, shown: int) -> None:
            made.append(set(known.short[:, 0].tolist()))
            assert torch.equal(known.short[:, 1:], draws.unit)
            super().__init__(known, draws, principal, shown)

        def __call__(self, known: Known) -> Seen:
            left.append(set(known.short[:, 0].tolist()))
            return super().__call__(known)

    monkeypatch.setattr(stacked, "View", Noted)
    unit = np.random.default_rng(0).random((40, 2))
    draws = Draws.of(unit, np.ones(40))
    columns = torch.cat([torch.arange(40.0, dtype=torch.float64)[:, None], draws.unit], dim=1)
    with torch.random.fork_rng():
        stacked.StackedDensity(
            Known(columns, [], []), draws, stacked.Shape(("mixture",), 4, 0.1, "box", 2, (4,), 1, 4, 4, 4),
            Schedule(1e-3, 0.0, 32, 1, 1), torch.Generator().manual_seed(0), torch.device("cpu"),
        )  # fmt: skip
    assert [len(m) for m in made] == [36] * 4
    assert all(m | out == set(range(40)) for m, out in zip(made, left, strict=True))
    assert len(set.union(*left)) == 16
