import numpy as np
import pytest

from muslin.core.errors import InputError
from muslin.core.testing import estimators as kit

torch = pytest.importorskip("torch")

from muslin.inference.embedding.fourier import FourierRows  # noqa: E402
from muslin.inference.embedding.rows import TrajectoryRows  # noqa: E402
from muslin.inference.estimators.bayessim_mdrff import BayesSimMDRFF  # noqa: E402


def quick(**options: object) -> BayesSimMDRFF:
    return BayesSimMDRFF(**{"members": 2, "max_epochs": 60, "patience": 8, "hidden": [32, 32], **options})  # type: ignore[arg-type]


@pytest.mark.slow
def test_conforms() -> None:
    kit.check_estimator(quick)


def test_sorted_sets_are_the_same_in_any_order() -> None:
    kit.check_permutation_invariant(lambda: quick(correspondence=False))


@pytest.mark.parametrize("kernel", ["rbf", "matern"])
def test_features_make_the_kernel_that_was_asked_for(kernel: str) -> None:
    x = [np.random.default_rng(0).standard_normal((40, 2, 2, 2))]
    source = TrajectoryRows(x, (True,), True, 5)
    blocks = source(x)
    generator = torch.Generator().manual_seed(0)
    rows = FourierRows(source, blocks, 40_000, kernel, 1.5, 0, generator)
    features = rows(x)[0]
    distance = torch.cdist(blocks[0], blocks[0])
    r = distance / (1.5 * torch.pdist(blocks[0]).median())
    root = 5.0**0.5 * r
    exact = torch.exp(-0.5 * r**2) if kernel == "rbf" else (1 + root + root**2 / 3) * torch.exp(-root)
    assert torch.allclose(features @ features.T, exact, atol=0.03)


def test_the_papers_preset_has_its_settings_and_runs() -> None:
    s = BayesSimMDRFF(preset="paper").settings
    assert (s.features, s.whitened, s.hidden, s.learning_rate) == (200, 0, (1024, 1024, 1024), 1e-6)
    theta, x = kit.LinearGaussian.make().draws(30, 0)
    short = BayesSimMDRFF(preset="paper", max_epochs=2, hidden=[32, 32, 32])
    short.fit(theta, x)
    kit.check_normalised(short.posterior([x[0][0]]), 2)


def test_an_unknown_kernel_is_refused() -> None:
    with pytest.raises(InputError, match="matern"):
        BayesSimMDRFF(kernel="cosine")
