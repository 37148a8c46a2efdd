from pathlib import Path

import numpy as np
import pytest

from muslin.core.errors import InputError, MissingFileError
from muslin.core.testing import estimators as kit

pytest.importorskip("scipy")

from muslin.inference.posterior.mixture import MixturePosterior


def some(seed: int = 0, dim: int = 2, push: float = 1.0) -> MixturePosterior:
    rng = np.random.default_rng(seed)
    factor = np.tril(rng.standard_normal((3, dim, dim)) * 0.3, -1) + 0.6 * np.eye(dim)
    return MixturePosterior(rng.random(3) + 0.1, push * rng.standard_normal((3, dim)), factor)


@pytest.mark.parametrize("push", [0.5, 1.5])
def test_is_inside_the_cube_and_normalised_also_against_its_faces(push: float) -> None:
    kit.check_shapes_and_support(some(push=push), 2)
    kit.check_normalised(some(push=push), 2)


def test_far_out_components_sample_inside() -> None:
    p = MixturePosterior(np.ones(2), np.array([[40.0], [-40.0]]), np.ones((2, 1, 1)))
    u = p.sample(100, np.random.default_rng(0))
    assert ((u > 0) & (u < 1)).all()


def test_the_standard_normal_is_the_flat_prior() -> None:
    flat = MixturePosterior(np.ones(1), np.zeros((1, 2)), np.eye(2)[None])
    assert flat.log_prob(np.random.default_rng(0).random((100, 2))) == pytest.approx(0.0, abs=1e-12)
    assert flat.mean() == pytest.approx([0.5, 0.5])
    assert flat.std() == pytest.approx([12**-0.5] * 2)


def test_mean_and_std_are_those_of_samples() -> None:
    u = some().sample(200_000, np.random.default_rng(0))
    assert some().mean() == pytest.approx(u.mean(axis=0), abs=2e-3)
    assert some().std() == pytest.approx(u.std(axis=0), abs=2e-3)


def test_average_is_the_mean_of_densities() -> None:
    points = np.random.default_rng(0).random((50, 2))
    each = [some(1), some(2)]
    mean = np.mean([np.exp(p.log_prob(points)) for p in each], axis=0)
    assert np.exp(MixturePosterior.average(each).log_prob(points)) == pytest.approx(mean)


def test_saving_is_exact_and_other_files_are_refused(tmp_path: Path) -> None:
    kit.check_save_and_load(some())
    path = tmp_path / "posterior.bin"
    some().save(path)
    assert np.array_equal(MixturePosterior.load(path).weights, some().weights)
    with pytest.raises(MissingFileError):
        MixturePosterior.load(tmp_path / "none.npz")
    path.write_text("nothing of the kind")
    with pytest.raises(InputError, match="not a saved"):
        MixturePosterior.load(path)
    with path.open("wb") as file:
        np.savez(file, a=np.zeros(2))
    with pytest.raises(InputError, match="not a saved"):
        MixturePosterior.load(path)


def test_what_is_no_density_is_refused() -> None:
    one, eye = np.ones(1), np.eye(2)[None]
    for bad in ((one, np.zeros((1, 3)), eye), (-one, np.zeros((1, 2)), eye), (one, np.full((1, 2), np.nan), eye),
                (one, np.zeros((1, 2)), -eye)):  # fmt: skip
        with pytest.raises(InputError):
            MixturePosterior(*bad)
    with pytest.raises(InputError, match="shape"):
        some().log_prob(np.zeros((4, 3)))
