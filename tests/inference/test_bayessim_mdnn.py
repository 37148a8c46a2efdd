import numpy as np
import pytest

from muslin.core.errors import InputError
from muslin.core.testing import estimators as kit

torch = pytest.importorskip("torch")

from muslin.inference.embedding.correlation import CorrelationRows  # noqa: E402
from muslin.inference.embedding.rows import TrajectoryRows  # noqa: E402
from muslin.inference.estimators.bayessim_mdnn import BayesSimMDNN  # noqa: E402


def quick(**options: object) -> BayesSimMDNN:
    return BayesSimMDNN(**{"members": 2, "max_epochs": 60, "patience": 8, "hidden": [32, 32], **options})  # type: ignore[arg-type]


@pytest.mark.slow
def test_conforms_on_trajectories() -> None:
    kit.check_estimator(quick)


@pytest.mark.slow
def test_conforms_on_summaries() -> None:
    """But for what needs to know where the points are: differences over time do not say."""
    checks = kit.estimator_checks(lambda: quick(on="summaries"), accuracy=False)
    for check in checks:
        if check.title != "reads every recording":
            check.run()


def test_sorted_sets_are_the_same_in_any_order_and_unsorted_ones_are_not() -> None:
    kit.check_permutation_invariant(lambda: quick(correspondence=False))
    with pytest.raises(AssertionError, match="permuting"):
        kit.check_permutation_invariant(lambda: quick(correspondence=False, sort=False))


def test_sets_may_have_fewer_points_than_in_training_and_more() -> None:
    theta, x = kit.LinearGaussian.make().draws(40, 0)
    estimator = quick(correspondence=False)
    estimator.fit(theta, x)
    kit.check_shapes_and_support(estimator.posterior([x[0][0, :, :3]]), 2)
    twice = estimator.posterior([np.repeat(x[0][0], 2, axis=1)])
    kit.check_shapes_and_support(twice, 2)


def test_weights_undo_a_proposal_that_is_not_the_prior() -> None:
    rng = np.random.default_rng(0)
    theta = rng.beta(2.0, 1.0, (600, 1))  # density 2 theta, prior 1
    x = [rng.standard_normal((600, 2, 3, 2))]  # says nothing: the posterior is the prior
    estimator = quick()
    estimator.fit(theta, x, log_weights=-np.log(2.0 * theta[:, 0]))
    means = [estimator.posterior([x[0][i]]).mean()[0] for i in range(20)]
    assert np.mean(means) == pytest.approx(0.5, abs=0.05)


@pytest.mark.slow
def test_two_far_modes_are_both_found() -> None:
    """x = |theta - 1/2| under little noise: the posterior has a mode on either side."""
    rng = np.random.default_rng(0)
    theta = rng.random((800, 1))
    x = [(np.abs(theta - 0.5) + 0.01 * rng.standard_normal((800, 1)))[:, None, :, None]]
    estimator = BayesSimMDNN()
    estimator.fit(theta, x)
    draws = estimator.posterior([np.full((1, 1, 1), 0.3)]).sample(4000, rng)[:, 0]
    low, high = np.mean(np.abs(draws - 0.2) < 0.06), np.mean(np.abs(draws - 0.8) < 0.06)
    assert low > 0.3 and high > 0.3 and low + high > 0.85


def test_summaries_are_bayessims() -> None:
    rng = np.random.default_rng(0)
    x = rng.standard_normal((30, 6, 3, 2)).cumsum(axis=1)
    rows = TrajectoryRows([x], (True,), True, 5)
    scaler = rows.encoder.scalers[0]
    state = x.reshape(30, 6, 6) / scaler.scale
    tau = np.diff(state, axis=1)
    actions = np.diff(x.mean(axis=(0, 2)), axis=0)
    actions /= np.sqrt((actions**2).mean())
    products = np.einsum("nti,tj->nij", tau, actions).reshape(30, -1) / 5
    wanted = np.concatenate([products, tau.mean(axis=1), tau.var(axis=1)], axis=1)
    assert np.allclose(CorrelationRows(rows)([x])[0].numpy(), wanted, atol=1e-9)


def test_summaries_need_two_frames() -> None:
    theta, x = kit.LinearGaussian.make().draws(20, 0)
    with pytest.raises(InputError, match="one frame"):
        quick(on="summaries").fit(theta, [x[0][:, :1]])


def test_the_papers_preset_has_its_settings_and_runs() -> None:
    s = BayesSimMDNN(preset="paper").settings
    assert (s.hidden, s.learning_rate, s.components, s.summaries) == ((1024, 1024, 1024), 1e-6, 4, False)
    theta, x = kit.LinearGaussian.make().draws(30, 0)
    short = BayesSimMDNN(preset="paper", max_epochs=2, hidden=[32, 32, 32])
    short.fit(theta, x)
    kit.check_normalised(short.posterior([x[0][0]]), 2)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"on": "frames"}, "trajectory"),
        ({"member": 3}, r"no option 'member'\. Did you mean 'members'\? Options: preset, "),
    ],
)
def test_options_that_make_no_sense_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        BayesSimMDNN(**options)  # type: ignore[arg-type]
