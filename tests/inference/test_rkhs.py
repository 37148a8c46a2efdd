import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

torch = pytest.importorskip("torch")

from muslin.inference.embedding.components import PrincipalComponents  # noqa: E402
from muslin.inference.embedding.points import PointScaler  # noqa: E402
from muslin.inference.embedding.ridge import KernelRidge  # noqa: E402
from muslin.inference.embedding.rkhs import RKHSEmbedding  # noqa: E402

LAYER = RKHSEmbedding(2, 2000, 1.0, torch.Generator().manual_seed(0))


@settings(max_examples=25)
@given(st.integers(1, 12), st.integers(0, 2**31), st.integers(0, 5))
def test_set_embedding_ignores_order_and_unseen_points(count: int, seed: int, unseen: int) -> None:
    g = torch.Generator().manual_seed(seed)
    points = torch.randn(count + unseen, 2, generator=g)
    seen = torch.arange(count + unseen) < count
    order = torch.randperm(count + unseen, generator=g)
    alone = LAYER(points[:count], seen[:count])
    assert torch.allclose(LAYER(points[order], seen[order]), alone, atol=1e-6)


def test_the_features_make_the_gaussian_kernel_and_the_size_stands_beside() -> None:
    a, b, seen = torch.tensor([[0.3, -0.2]]), torch.tensor([[1.0, 0.4]]), torch.ones(1, dtype=torch.bool)
    with torch.no_grad():
        product = float(LAYER(a, seen)[:-2] @ LAYER(b, seen)[:-2])
        size = LAYER(torch.zeros(4, 2), torch.ones(4, dtype=torch.bool))[-2:]
    assert product == pytest.approx(math.exp(-0.5 * float(((a - b) ** 2).sum())), abs=0.05)
    assert size.tolist() == pytest.approx([math.log(4), 0.5])


def test_frequencies_and_bandwidth_are_learned_and_an_empty_frame_is_finite() -> None:
    layer = RKHSEmbedding(2, 8, 1.0, torch.Generator().manual_seed(0))
    out = layer(torch.zeros(3, 2), torch.zeros(3, dtype=torch.bool))
    assert torch.isfinite(out).all()
    layer(torch.randn(3, 2), torch.ones(3, dtype=torch.bool)).sum().backward()
    assert layer.frequencies.grad is not None
    assert layer.log_bandwidth.grad is not None


def test_sets_are_standardised_to_the_same_bits_in_any_order() -> None:
    x = np.random.default_rng(0).standard_normal((6, 3, 5, 2))
    x[0, 0, 1] = np.nan
    scaler = PointScaler.fit(x, correspondence=False)
    for a, b in zip(scaler.transform(x), scaler.transform(x[:, :, ::-1]), strict=True):
        assert np.array_equal(a, b)


def test_left_out_predictions_are_those_of_regressions_that_never_saw_the_draw() -> None:
    rng = torch.Generator().manual_seed(0)
    f = torch.randn(30, 2, generator=rng, dtype=torch.float64)
    y = torch.sin(f[:, :1]) + 0.1 * torch.randn(30, 1, generator=rng, dtype=torch.float64)
    whole = KernelRidge(f, y, torch.ones(30, dtype=torch.float64))
    error = (whole.left_out - y).pow(2).mean().sqrt()
    fit = (whole.predict(f) - y).pow(2).mean().sqrt()
    assert fit < error < 0.3


def test_gaps_are_filled_from_the_other_entries() -> None:
    rng = torch.Generator().manual_seed(0)
    rows = torch.randn(100, 2, generator=rng, dtype=torch.float64) @ torch.randn(
        2, 30, generator=rng, dtype=torch.float64
    )
    components = PrincipalComponents(rows, None, 5)
    seen = torch.rand(100, 30, generator=rng) > 0.3
    filled = components.complete(torch.where(seen, rows, torch.zeros_like(rows)), seen)
    assert (filled - rows).abs().max() < 1e-3
