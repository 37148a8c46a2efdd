from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.errors import InputError, MissingFileError
from muslin.core.testing import estimators as kit

torch = pytest.importorskip("torch")
stats = pytest.importorskip("scipy.stats")
pytest.importorskip("zuko")

from muslin.inference.density.coordinates import Coordinates, fitted_scale  # noqa: E402
from muslin.inference.density.device import device_of  # noqa: E402
from muslin.inference.density.ensemble import Schedule, left_out, train_ensemble  # noqa: E402
from muslin.inference.density.first_guess import FirstGuess  # noqa: E402
from muslin.inference.density.flow import FlowNetwork, FlowShape  # noqa: E402
from muslin.inference.density.sparse_regression import SparseRegression  # noqa: E402
from muslin.inference.density.stacking import stack  # noqa: E402
from muslin.inference.posterior.files import load_posterior  # noqa: E402
from muslin.inference.posterior.flow import FlowPosterior  # noqa: E402
from muslin.inference.posterior.latent import LatentFlow, LatentMixture  # noqa: E402


def network(dim: int = 2, features: int = 3, gain: float = 8.0) -> FlowNetwork:
    """A flow that is far from the identity."""
    with torch.random.fork_rng():
        torch.manual_seed(0)
        made = FlowNetwork(FlowShape(features, dim, 2, (16, 16), 6))
        with torch.no_grad():
            for p in made.parameters():
                p.mul_(gain if p.dim() > 1 and p.shape[0] > 16 else 1.0)
    return made


def some(dim: int = 2, mean: float = 0.3, scale: float = 0.1) -> FlowPosterior:
    cholesky = 0.7 * np.eye(dim) + np.tril(np.full((dim, dim), 0.2), -1)
    about = Coordinates.about(np.full(dim, mean), np.full(dim, scale))
    flow = LatentFlow(about, np.ones(3), np.full(dim, 0.3), cholesky, network(dim))
    flat = LatentMixture(Coordinates.probit(dim), np.ones(1), np.zeros((1, dim)), np.eye(dim)[None])
    return FlowPosterior(np.array([0.8, 0.2]), [flow, flat])


# A place and a width: flat, inside, at a face, beyond one, far beyond one.
PLACES = [(0.5, np.inf), (0.5, 0.05), (0.02, 0.05), (1.2, 0.05), (-9.0, 0.02), (0.3, 3.0)]


@pytest.mark.parametrize(("mean", "scale"), PLACES)
def test_coordinates_go_there_and_back_and_know_their_slope(mean: float, scale: float) -> None:
    coordinates = Coordinates.about(np.array([mean]), np.array([scale]))
    u = np.concatenate([[1e-9, 1e-6], np.linspace(0.003, 0.997, 99), [1 - 1e-6]])[:, None]
    z = coordinates.to_latent(u)
    assert (np.diff(z[:, 0]) > 0).all()
    assert coordinates.to_unit(z) == pytest.approx(u, rel=1e-6)
    step = 1e-6
    slope = (coordinates.to_latent(u + step) - coordinates.to_latent(u - step))[3:-2] / (2 * step)
    assert np.exp(coordinates.log_slope(u, z))[3:-2] == pytest.approx(slope, rel=1e-4)
    far = coordinates.to_unit(np.array([[-1e3], [1e3]]))
    assert ((far > 0) & (far < 1)).all()


@pytest.mark.parametrize(("mean", "scale"), PLACES[1:3])
def test_a_standard_normal_in_them_is_a_normal_cut_at_the_faces(mean: float, scale: float) -> None:
    coordinates = Coordinates.about(np.array([mean]), np.array([scale]))
    normal = LatentMixture(coordinates, np.ones(1), np.zeros((1, 1)), np.ones((1, 1, 1)))
    u = np.linspace(0.001, 0.999, 200)[:, None]
    exact = stats.truncnorm.logpdf(u[:, 0], -mean / scale, (1 - mean) / scale, mean, scale)
    assert FlowPosterior(np.ones(1), [normal]).log_prob(u) == pytest.approx(exact, rel=1e-6, abs=1e-6)


def test_the_scale_of_cut_normals_is_found_and_of_uniform_draws_is_infinite() -> None:
    rng = np.random.default_rng(0)
    mean = rng.random((4000, 2))
    drawn = stats.truncnorm.rvs(-mean / 0.2, (1 - mean) / 0.2, mean, 0.2, random_state=rng)
    unit = np.stack([drawn[:, 0], rng.random(4000)], axis=1)
    mean[:, 1] = 0.5
    first, second = fitted_scale(mean, unit, np.ones(4000))
    assert first == pytest.approx(0.2, rel=0.12)
    assert second > 1.0


@pytest.mark.parametrize(("mean", "scale"), PLACES)
def test_the_posterior_is_normalised_and_inside(mean: float, scale: float) -> None:
    posterior = some(1, mean, scale)
    kit.check_shapes_and_support(posterior, 1)
    # Over the latent coordinate, in which the flow's density is smooth also against a face.
    coordinates, posterior = posterior.parts[0].coordinates, FlowPosterior(np.ones(1), posterior.parts[:1])
    z = np.linspace(-6.0, 6.0, 4001)[:, None]
    u = coordinates.to_unit(z)
    density = np.exp(posterior.log_prob(u) - coordinates.log_slope(u, z)[:, 0])
    assert density.sum() * (z[1, 0] - z[0, 0]) == pytest.approx(1.0, abs=5e-3)


@pytest.mark.parametrize("dim", [1, 2, 4])
def test_samples_follow_the_density(dim: int) -> None:
    """The mean of exp(reference - log_prob) over samples is the reference's mass: one."""
    posterior = some(dim=dim)
    draws = posterior.sample(20_000, np.random.default_rng(0))
    reference = LatentMixture(Coordinates.probit(dim), np.ones(1), np.zeros((1, dim)), np.eye(dim)[None])
    ratio = np.exp(FlowPosterior(np.ones(1), [reference]).log_prob(draws) - posterior.log_prob(draws))
    assert ratio.mean() == pytest.approx(1.0, abs=0.05)


def test_saving_is_exact_and_other_files_are_refused(tmp_path: Path) -> None:
    kit.check_save_and_load(some())
    path = tmp_path / "posterior.bin"
    some().save(path)
    points = np.random.default_rng(0).random((50, 2))
    assert np.array_equal(load_posterior(path).log_prob(points), some().log_prob(points))
    with pytest.raises(MissingFileError):
        FlowPosterior.load(tmp_path / "none")
    path.write_text("nothing of the kind")
    with pytest.raises(InputError, match="not a saved"):
        FlowPosterior.load(path)
    with path.open("wb") as file:
        np.savez(file, format=FlowPosterior.format, part_weights=np.ones(1), **{"part_0/kind": "other"})
    with pytest.raises(InputError, match="not a saved"):
        FlowPosterior.load(path)


def test_what_is_no_density_is_refused() -> None:
    part = LatentMixture(Coordinates.probit(2), np.ones(1), np.zeros((1, 2)), np.eye(2)[None])
    for weights, parts in ((np.ones(0), []), (np.ones(2), [part]), (-np.ones(1), [part]), (np.zeros(1), [part])):
        with pytest.raises(InputError):
            FlowPosterior(weights, parts)
    with pytest.raises(InputError, match="shape"):
        some().log_prob(np.zeros((3, 5)))


def test_relevance_finds_the_coefficients_and_left_out_errors() -> None:
    rng = np.random.default_rng(0)
    features = rng.standard_normal((300, 40))
    true = np.zeros((40, 2))
    true[3], true[7, 1] = [1.0, -0.5], 2.0
    z = features @ true + 0.3 * rng.standard_normal((300, 2))
    fit = SparseRegression.fit(features, z, np.ones(300))
    assert fit.coefficients == pytest.approx(true, abs=0.08)
    # Most of what least squares gets wrong are the columns of noise.
    plain = np.linalg.lstsq(features, z, rcond=None)[0]
    assert (np.abs(fit.coefficients - true) ** 2).sum() < 0.5 * (np.abs(plain - true) ** 2).sum()
    fresh = rng.standard_normal((5000, 40))
    error = fresh @ true + 0.3 * rng.standard_normal((5000, 2)) - fit.mean(fresh)
    assert fit.residual.std(axis=0) == pytest.approx(error.std(axis=0), rel=0.12)


@pytest.mark.parametrize("draws", [80, 100, 400])
def test_left_out_errors_are_as_large_as_those_of_new_draws(draws: int) -> None:
    """Also with as many features as draws, most of them noise, where the errors of the fit itself are next to none."""
    rng = np.random.default_rng(1)
    slope = np.where(np.arange(80) < 5, 1.0, 0.0)[:, None]
    features, fresh = rng.standard_normal((draws, 80)), rng.standard_normal((4000, 80))
    z, new = features @ slope + rng.standard_normal((draws, 1)), fresh @ slope + rng.standard_normal((4000, 1))
    line = SparseRegression.fit(features, z, np.ones(draws))
    left_out, met = np.std(line.residual), np.std(new - line.mean(fresh))
    assert 0.9 * met < left_out < 1.5 * met  # those who left out a fifth know a little less


def test_a_first_guess_is_the_better_of_two_parameter_by_parameter() -> None:
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((200, 3))
    z = np.stack([columns[:, 0], np.sin(3 * columns[:, 1])], axis=1) + 0.1 * rng.standard_normal((200, 2))
    other = np.stack([columns[:, 2], np.sin(3 * columns[:, 1])], axis=1)
    first = FirstGuess.fit(columns, z, np.ones(200), other)
    assert first.elsewhere.tolist() == [False, True]
    assert np.std(first.residual, axis=0) == pytest.approx([0.1, 0.1], rel=0.15)
    assert first.mean(columns[:1], other[:1])[0] == pytest.approx([columns[0, 0], other[0, 1]], abs=0.1)
    assert not FirstGuess.fit(columns, z, np.ones(200), None).elsewhere.any()


def test_stacking_finds_the_weights_of_a_known_mixture() -> None:
    rng = np.random.default_rng(0)
    values = np.where(rng.random(20_000) < 0.7, rng.standard_normal(20_000), 4 + 0.5 * rng.standard_normal(20_000))

    def normal(mean: float, sd: float) -> FloatArray:
        return np.asarray(-0.5 * ((values - mean) / sd) ** 2 - np.log(sd))

    found = stack(np.stack([normal(0, 1), normal(4, 0.5), normal(-9, 1)], axis=1), np.ones(20_000))
    assert found == pytest.approx([0.7, 0.3, 0.0], abs=0.02)
    # A density that rules a draw out gets no weight.
    ruled_out = np.where(np.arange(20_000) == 0, -np.inf, normal(0, 1) + 1)
    assert stack(np.stack([normal(0, 5), ruled_out], axis=1), np.ones(20_000))[0] > 0


def fit_ensemble(z: torch.Tensor, context: torch.Tensor, make: Callable[[], FlowNetwork]) -> torch.Tensor:
    generator = torch.Generator().manual_seed(0)
    with torch.random.fork_rng():
        torch.manual_seed(0)
        members = [make() for _ in range(3)]
    held = left_out(len(z), 3, 0.1, generator)
    schedule = Schedule(1e-2, 1e-3, 90, 12, 8)
    inputs, targets, weights = [context.expand(3, -1, -1)], z.expand(3, -1, -1), torch.ones(len(z))
    return train_ensemble(members, inputs, targets, weights, held, schedule, generator, torch.device("cpu"))


def test_an_ensemble_learns_a_scale_that_depends_on_the_context() -> None:
    generator = torch.Generator().manual_seed(1)
    context = torch.rand(600, 1, generator=generator)
    scale = 0.1 + context
    z = scale * torch.randn(600, 1, generator=generator)
    scores = fit_ensemble(z, context, lambda: FlowNetwork(FlowShape(1, 1, 2, (16,), 6)))
    scored = torch.isfinite(scores)
    assert int(scored.sum()) == 180
    exact = torch.distributions.Normal(0.0, scale).log_prob(z)[:, 0]
    still = torch.distributions.Normal(0.0, z.std()).log_prob(z)[:, 0]
    gained = float((scores - still)[scored].mean())
    assert gained > 0.5 * float((exact - still)[scored].mean())


def test_left_out_sets_are_disjoint_and_of_one_size() -> None:
    held = left_out(100, 4, 0.5, torch.Generator().manual_seed(0))
    assert held.sum(0).max() == 1
    assert held.sum(1).tolist() == [25] * 4


def test_a_device_that_is_not_there_is_refused() -> None:
    assert device_of("cpu").type == "cpu"
    with pytest.raises(InputError, match="one of"):
        device_of("gpu")
    if not torch.cuda.is_available():
        assert device_of("auto").type == "cpu"
        with pytest.raises(InputError, match="no graphics processor"):
            device_of("cuda")
