import numpy as np
import pytest

from muslin.core.errors import InputError, StepMissingError
from muslin.core.testing import estimators as kit

torch = pytest.importorskip("torch")

from torch_state import check_torch_is_left_alone  # noqa: E402

from muslin.inference.density.training import importance_weights  # noqa: E402
from muslin.inference.estimators.bayessim_rkhs import BayesSimRKHS  # noqa: E402


def quick(**options: object) -> BayesSimRKHS:
    return BayesSimRKHS(**{"features": 16, "max_epochs": 5, "members": 2, "summary_epochs": 40, **options})  # type: ignore[arg-type]


def test_conforms_with_corresponding_points() -> None:
    kit.check_estimator(quick)


def test_conforms_on_sets() -> None:
    kit.check_estimator(lambda: quick(correspondence=False), ordered=False)


def test_the_order_of_sets_matters_not_to_the_last_bit() -> None:
    theta, x = kit.LinearGaussian.make().draws(60, 0)
    estimator = quick(correspondence=False)
    estimator.fit(theta, x)
    grid = np.random.default_rng(0).random((20, 2))
    a, b = (estimator.posterior([row]).log_prob(grid) for row in (x[0][0], x[0][0][:, ::-1]))
    assert np.array_equal(a, b)


def test_corresponding_points_are_told_apart() -> None:
    with pytest.raises(AssertionError, match="permuting"):
        kit.check_permutation_invariant(quick)


def test_mean_and_sd_are_near_the_exact_ones_of_a_linear_gaussian_case() -> None:
    kit.check_linear_gaussian(BayesSimRKHS, mean_error=0.5, spread=(0.8, 1.5))


def test_torch_generator_and_threads_are_left_alone_and_do_not_matter() -> None:
    check_torch_is_left_alone(quick)


def test_another_seed_gives_another_posterior() -> None:
    theta, x = kit.LinearGaussian.make().draws(40, 0)
    means = []
    for seed in (0, 1):
        estimator = quick()
        estimator.fit(theta, x, seed=seed)
        means.append(estimator.posterior([x[0][0]]).mean())
    assert not np.array_equal(*means)


def test_weights_undo_a_proposal_that_is_not_the_prior() -> None:
    """Draws say nothing here, so the posterior is the prior, whatever the draws were taken from."""
    rng = np.random.default_rng(0)
    theta = rng.beta(2.0, 1.0, (600, 1))  # density 2 theta, prior 1
    x = [rng.standard_normal((600, 2, 3, 2))]
    log_weights = -np.log(2.0 * theta[:, 0])
    means = {}
    for name, w in (("ignored", None), ("given", log_weights)):
        estimator = quick()
        estimator.fit(theta, x, log_weights=w)
        means[name] = np.mean([estimator.posterior([x[0][i]]).mean()[0] for i in range(20)])
    assert means["ignored"] == pytest.approx(2 / 3, abs=0.05)
    assert means["given"] == pytest.approx(1 / 2, abs=0.05)


def test_draws_of_weight_zero_are_as_if_left_out() -> None:
    theta, x = kit.LinearGaussian.make().draws(60, 0)
    kept = np.arange(60) % 3 > 0
    a, b = quick(), quick()
    a.fit(theta, x, log_weights=np.where(kept, 0.0, -np.inf))
    b.fit(theta[kept], [x[0][kept]])
    grid = np.random.default_rng(0).random((20, 2))
    assert np.allclose(a.posterior([x[0][0]]).log_prob(grid), b.posterior([x[0][0]]).log_prob(grid), atol=1e-5)


def test_importance_weights_are_normalised_and_truncated() -> None:
    assert np.array_equal(importance_weights(None, 4), np.ones(4))
    assert importance_weights(np.log([1.0, 3.0]), 2) == pytest.approx([0.5 / 0.957107, 1.414214 / 0.957107], rel=1e-4)
    one_rules = importance_weights(np.array([50.0] + [0.0] * 99), 100)
    assert one_rules.mean() == pytest.approx(1.0)
    assert np.isfinite(one_rules).all()
    for bad in ([0.0, np.nan], [0.0, np.inf], [-np.inf, -np.inf], [0.0]):
        with pytest.raises(InputError):
            importance_weights(np.array(bad), 2)


def test_recordings_may_differ_in_frames_points_and_correspondence() -> None:
    rng = np.random.default_rng(0)
    theta = rng.random((40, 2))
    x = [rng.standard_normal((40, 3, 4, 2)), rng.standard_normal((40, 5, 7, 2)) + theta[:, :1, None, None]]
    estimator = quick(correspondence=[True, False])
    estimator.fit(theta, x)
    posterior = estimator.posterior([x[0][0], x[1][0, :, :3]])  # fewer points in the set
    kit.check_shapes_and_support(posterior, 2)
    with pytest.raises(InputError, match="resample"):
        estimator.posterior([x[0][0, :, :3], x[1][0]])
    with pytest.raises(InputError, match="2 recordings"):
        estimator.posterior([x[0][0]])


def test_clouds_of_thousands_of_points_of_any_number_some_missing() -> None:
    rng = np.random.default_rng(0)
    theta = rng.random((60, 1))
    cloud = rng.random((60, 2, 2000, 2)) * np.stack([np.ones((60, 1)), 0.2 + theta], axis=-1)[:, None]
    cloud[rng.random((60, 2, 2000)) < 0.2] = np.nan
    cloud[::3, :, 500:] = np.nan
    estimator = quick(correspondence=False)
    estimator.fit(theta, [cloud])
    for count in (300, 3000):
        row = rng.random((2, count, 2)) * [1.0, 0.2 + 0.5]
        assert estimator.posterior([row]).mean()[0] == pytest.approx(0.5, abs=0.1)


def test_a_marker_lost_only_in_the_measurement_does_not_move_the_mean_far() -> None:
    case = kit.LinearGaussian.make()
    theta, x = case.draws(200, 0)
    estimator = BayesSimRKHS()
    estimator.fit(theta, x)
    full = case.simulate(np.array([[0.75, 0.3]]), np.random.default_rng(1))[0]
    gappy = full.copy()
    gappy[:, 3] = np.nan
    shift = estimator.posterior([gappy]).mean() - estimator.posterior([full]).mean()
    assert (np.abs(shift) < 3 * np.sqrt(np.diag(case.covariance))).all()


def test_the_papers_preset_has_its_settings_and_runs() -> None:
    paper = BayesSimRKHS(preset="paper")
    assert paper.settings.hidden == (1024, 1024, 1024)
    assert paper.settings.learning_rate == 1e-6
    assert paper.settings.components == 4
    theta, x = kit.LinearGaussian.make().draws(30, 0)
    short = BayesSimRKHS(preset="paper", max_epochs=2, hidden=[32, 32, 32])
    short.fit(theta, x)
    kit.check_normalised(short.posterior([x[0][0]]), 2)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"preset": "papr"}, "no preset 'papr'"),
        ({"epochs": 3}, "no option 'epochs'"),
        ({"features": 0}, "above zero"),
        ({"components": "4"}, "above zero"),
        ({"hidden": []}, "list of widths"),
    ],
)
def test_options_that_make_no_sense_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        BayesSimRKHS(**options)  # type: ignore[arg-type]


def test_inputs_that_make_no_sense_are_refused() -> None:
    theta, x = kit.LinearGaussian.make().draws(20, 0)
    with pytest.raises(StepMissingError):
        quick().posterior([x[0][0]])
    with pytest.raises(InputError, match="unit cube"):
        quick().fit(theta + 1, x)
    with pytest.raises(InputError, match="too few"):
        quick().fit(theta[:9], [x[0][:9]])
    with pytest.raises(InputError, match="must have shape"):
        quick().fit(theta, [x[0][:5]])
    estimator = quick()
    estimator.fit(theta, x)
    with pytest.raises(InputError, match="no point that was seen"):
        estimator.posterior([np.full_like(x[0][0], np.nan)])
