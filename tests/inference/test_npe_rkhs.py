import time

import numpy as np
import pytest

from muslin.core.errors import InputError, StepMissingError
from muslin.core.testing import estimators as kit

torch = pytest.importorskip("torch")
pytest.importorskip("zuko")

from torch_state import check_torch_is_left_alone  # noqa: E402

from muslin.inference.embedding.columns import Standard, relevant  # noqa: E402
from muslin.inference.embedding.moments import moments  # noqa: E402
from muslin.inference.estimators.npe_rkhs import NPERKHS  # noqa: E402


def quick(**options: object) -> NPERKHS:
    small = {"members": 2, "epochs": 8, "hidden": [16], "kernel_features": 8, "time_epochs": 3, "transforms": 2}
    return NPERKHS(**{**small, **options})  # type: ignore[arg-type]


@pytest.mark.slow
def test_conforms_with_corresponding_points() -> None:
    kit.check_estimator(quick)


@pytest.mark.slow
def test_conforms_on_sets() -> None:
    kit.check_estimator(lambda: quick(correspondence=False, heads="mixture"), ordered=False)


@pytest.mark.slow
def test_a_posterior_with_more_than_one_mode_is_found() -> None:
    """x tells the distance of the parameter from the middle and not the side."""
    rng = np.random.default_rng(0)
    theta = rng.random((400, 1))
    x = np.abs(theta - 0.5)[:, None, :, None] + 0.02 * rng.standard_normal((400, 1, 1, 1))
    estimator = NPERKHS(members=2, epochs=25, hidden=[32], transforms=2)
    estimator.fit(theta, [x])
    draws = estimator.posterior([np.full((1, 1, 1), 0.3)]).sample(4000, np.random.default_rng(1))[:, 0]
    left = (np.abs(draws - 0.2) < 0.08).mean()
    right = (np.abs(draws - 0.8) < 0.08).mean()
    assert left + right > 0.9
    assert 0.3 < left / (left + right) < 0.7


def test_columns_of_noise_are_left_out_and_those_that_matter_kept() -> None:
    rng = np.random.default_rng(0)
    unit = rng.random((800, 2))
    columns = rng.standard_normal((800, 90))
    columns[:, 11] += unit[:, 0] - 0.5
    columns[:, 40] *= 0.5 + unit[:, 1]
    kept = relevant(columns, unit, None, np.ones(800), 40)
    assert {11, 40} <= set(kept.tolist())
    assert len(kept) < 8
    trust = unit - 0.5 + (0.2 + np.exp(columns[:, 70:71])) * rng.standard_normal((800, 2))
    assert 70 in relevant(columns, unit, trust, np.ones(800), 40)


def test_wild_entries_and_far_measurements_stay_bounded() -> None:
    rng = np.random.default_rng(0)
    rows = rng.standard_normal((200, 3))
    rows[3, 0], rows[:, 2] = 1e9, 5.0
    standard = Standard(rows)
    out = standard(rows)
    assert np.isfinite(out).all()
    assert np.abs(out[:, 0]).max() < 20
    assert (out[:, 2] == 0).all()
    assert np.abs(standard(np.full((1, 3), -1e12))).max() < 20


def test_a_measurement_far_outside_gives_a_proper_posterior() -> None:
    theta, x = kit.LinearGaussian.make().draws(80, 0)
    estimator = quick()
    estimator.fit(theta, x)
    posterior = estimator.posterior([x[0][0] + 1e6])
    kit.check_shapes_and_support(posterior, 2)
    kit.check_normalised(posterior, 2)


def test_moments_are_those_of_the_points_seen() -> None:
    points = np.random.default_rng(0).standard_normal((1, 1, 6, 2))
    seen = np.array([[[True, True, True, True, False, False]]])
    mean_x, mean_y, sd_x, sd_y, slant, log_n, root_n = moments(points, seen)[0, 0]
    kept = points[0, 0, :4]
    assert [mean_x, mean_y] == pytest.approx(kept.mean(axis=0))
    assert np.exp([sd_x, sd_y]) == pytest.approx(kept.std(axis=0))
    assert np.tanh(slant) == pytest.approx(np.corrcoef(kept.T)[0, 1])
    assert [np.exp(log_n), root_n] == pytest.approx([4, 0.5])
    empty = moments(points, np.zeros((1, 1, 6), bool))
    assert np.isfinite(empty).all()


def test_torch_generator_and_threads_are_left_alone_and_do_not_matter() -> None:
    check_torch_is_left_alone(quick)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a graphics processor")
def test_a_graphics_processor_gives_the_posterior_of_the_processor() -> None:
    theta, x = kit.LinearGaussian.make().draws(200, 0)
    means = []
    for device in ("cpu", "cuda"):
        estimator = NPERKHS(device=device)
        estimator.fit(theta, x)
        means.append(estimator.posterior([x[0][0]]).mean())
    assert means[0] == pytest.approx(means[1], abs=0.03)


@pytest.mark.slow
def test_ten_thousand_samples_take_less_than_a_second() -> None:
    theta, x = kit.LinearGaussian.make().draws(100, 0)
    estimator = NPERKHS(epochs=3, time_epochs=1, heads="flow")
    estimator.fit(theta, x)
    posterior = estimator.posterior([x[0][0]])
    start = time.process_time()
    posterior.sample(10_000, np.random.default_rng(0))
    assert time.process_time() - start < 1.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"preset": "papr"}, "no preset 'papr'"),
        ({"rounds": 3}, "no option 'rounds'"),
        ({"heads": "spline"}, "heads must be"),
        ({"coordinates": "logit"}, "coordinates must be"),
        ({"device": "gpu"}, "device must be"),
    ],
)
def test_options_that_make_no_sense_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        NPERKHS(**options)  # type: ignore[arg-type]


def test_weights_are_asked_for_after_fit() -> None:
    with pytest.raises(StepMissingError):
        _ = quick().weights
    theta, x = kit.LinearGaussian.make().draws(40, 0)
    estimator = quick()
    estimator.fit(theta, x)
    assert sum(estimator.weights.values()) == pytest.approx(1.0)


@pytest.mark.slow
def test_few_draws_of_a_long_trajectory_do_not_make_it_sure_of_itself() -> None:
    """A hundred draws of 360 numbers with little noise, of which any regression could fit all that it has seen."""
    rng = np.random.default_rng(0)
    time, point, axis = np.ogrid[0:1:20j, 0:1:6j, 0:3]

    def simulate(theta: np.ndarray) -> np.ndarray:
        a, b, c = theta.T[..., None, None, None]
        bent = np.sin(3 * time * (1 + a) + point + axis) * (0.5 + b) + 0.3 * np.exp(-2 * time * c) * point
        x: np.ndarray = bent + 0.2 * np.cos(9 * time * b * c + axis)
        return x + 0.15 * rng.standard_normal(x.shape)

    theta, truth = rng.random((100, 3)), rng.random((60, 3))
    estimator = NPERKHS()
    estimator.fit(theta, [simulate(theta)])
    ranks = [
        (estimator.posterior([x]).sample(400, rng) < t).mean(axis=0)
        for t, x in zip(truth, simulate(truth), strict=True)
    ]
    held = np.mean((np.array(ranks) > 0.1) & (np.array(ranks) < 0.9), axis=0)
    assert (held > 0.63).all(), f"80 % intervals hold the truth in {(100 * held).round()} % of cases"
