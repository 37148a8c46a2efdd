"""What every estimator on torch owes to whoever else uses torch in the process."""

import numpy as np
import torch

from muslin.core.testing import estimators as kit


def check_torch_is_left_alone(make: kit.MakeEstimator) -> None:
    """Generator and threads of torch are as before, and how they stood does not change the posterior by a bit."""
    theta, x = kit.LinearGaussian.make().draws(40, 0)
    grid = np.random.default_rng(0).random((20, 2))
    before = torch.get_num_threads()
    answers = []
    try:
        for threads in (1, 2):
            torch.set_num_threads(threads)
            torch.manual_seed(threads)
            state = torch.get_rng_state()
            estimator = make()
            estimator.fit(theta, x, seed=3)
            answers.append(estimator.posterior([x[0][0]]).log_prob(grid))
            assert torch.equal(state, torch.get_rng_state())
            assert torch.get_num_threads() == threads
    finally:
        torch.set_num_threads(before)
    assert np.array_equal(*answers)
