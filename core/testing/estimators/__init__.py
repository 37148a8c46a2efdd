"""Conformance kit for posterior estimators: small checks that raise AssertionError, with numpy alone.

Example:
    >>> from muslin.core.testing import check_estimator             # doctest: +SKIP
    >>> check_estimator(MyEstimator)                                # doctest: +SKIP
    >>> check_estimator(lambda: MyEstimator(correspondence=False), ordered=False)  # doctest: +SKIP
"""

from collections.abc import Callable
from functools import cache, partial
from inspect import signature
from typing import Any

from ...estimator import Posterior
from ..checks import Check, raise_failures
from .accuracy import (
    check_at_bounds,
    check_calibrated,
    check_linear_gaussian,
    check_size_of_sets,
    check_weights_honoured,
)
from .behaviour import (
    check_deterministic,
    check_fit_comes_first,
    check_global_random_state,
    check_inputs_left_alone,
    check_permutation_invariant,
)
from .cases import Cloud, LinearGaussian, MakeEstimator, fitted
from .inputs import (
    check_constant_summaries,
    check_failed_draws,
    check_missing_points,
    check_several_recordings,
    check_too_few_draws,
    check_varying_counts,
)
from .posterior import (
    check_normalised,
    check_samples_follow_density,
    check_sampling_speed,
    check_save_and_load,
    check_shapes_and_support,
)

__all__ = [
    "Cloud",
    "LinearGaussian",
    "MakeEstimator",
    "check_at_bounds",
    "check_calibrated",
    "check_constant_summaries",
    "check_deterministic",
    "check_estimator",
    "check_failed_draws",
    "check_fit_comes_first",
    "check_global_random_state",
    "check_inputs_left_alone",
    "check_linear_gaussian",
    "check_missing_points",
    "check_normalised",
    "check_permutation_invariant",
    "check_samples_follow_density",
    "check_sampling_speed",
    "check_save_and_load",
    "check_several_recordings",
    "check_shapes_and_support",
    "check_size_of_sets",
    "check_too_few_draws",
    "check_varying_counts",
    "check_weights_honoured",
    "estimator_checks",
    "installed_estimator_checks",
]

_POSTERIOR: dict[str, Callable[[Posterior], None]] = {
    "samples and density have their shapes and support": lambda p: check_shapes_and_support(p, 2),
    "the density integrates to one": lambda p: check_normalised(p, 2),
    "samples follow the density": lambda p: check_samples_follow_density(p, 2),
    "10 000 samples in a second": check_sampling_speed,
    "a saved posterior comes back to the bit": check_save_and_load,
}
_ALWAYS: dict[str, Callable[[MakeEstimator], None]] = {
    "repeats bit for bit": check_deterministic,
    "global random state untouched": check_global_random_state,
    "leaves what it is given as it is": check_inputs_left_alone,
    "says so when asked before fit": check_fit_comes_first,
    "refuses too few draws": check_too_few_draws,
    "refuses failed draws": check_failed_draws,
    "draws that tell nothing give the prior": check_constant_summaries,
    "reads points that are missing": check_missing_points,
    "reads every recording": check_several_recordings,
}
_SETS: dict[str, Callable[[MakeEstimator], None]] = {
    "the order of points has no influence": check_permutation_invariant,
    "reads sets of every size": check_varying_counts,
}
_ACCURACY: dict[str, Callable[[MakeEstimator], None]] = {
    "honours importance weights": check_weights_honoured,
    "stays proper at the prior's bounds": check_at_bounds,
}
_ORDERED_ACCURACY: dict[str, Callable[[MakeEstimator], None]] = {
    "recovers a known posterior": check_linear_gaussian,
    "is as often right as it says": check_calibrated,
}
_SET_ACCURACY: dict[str, Callable[[MakeEstimator], None]] = {
    "knows that more points tell more": check_size_of_sets,
}


def estimator_checks(make: MakeEstimator, *, ordered: bool = True, accuracy: bool = True) -> list[Check]:
    """Every promise of an estimator, with what :func:`check_estimator` says of the arguments."""
    titled = dict(_ALWAYS)
    if not ordered:
        titled |= _SETS
    if accuracy:
        titled |= _ACCURACY | (_ORDERED_ACCURACY if ordered else _SET_ACCURACY)

    @cache
    def posterior() -> Posterior:
        estimator, row = fitted(make)
        return estimator.posterior(row)

    def of_posterior(check: Callable[[Posterior], None]) -> None:
        check(posterior())

    return [Check(title, partial(of_posterior, check)) for title, check in _POSTERIOR.items()] + [
        Check(title, partial(check, make)) for title, check in titled.items()
    ]


def check_estimator(make: MakeEstimator, *, ordered: bool = True, accuracy: bool = True) -> None:
    """Every check in turn; the slower ones train on a few hundred draws.

    Args:
        make: builds a fresh estimator; called many times.
        ordered: whether the order of the points may matter. False checks permutation invariance and sets of every
            size, and leaves out the linear case, whose closed form needs to know the points apart.
        accuracy: whether it promises to come near known posteriors; False for one that is made quick for a test, or
            that is an approximation by design.

    Raises:
        AssertionError: lists every check that failed, saying how.
    """
    name = getattr(make, "name", getattr(make, "__name__", "the estimator"))
    raise_failures(str(name), estimator_checks(make, ordered=ordered, accuracy=accuracy))


def installed_estimator_checks(estimator: Any) -> list[Check]:
    """What ``muslin check`` runs: with corresponding points and, if it takes that option, with sets of points."""
    checks = estimator_checks(estimator)
    if "correspondence" in signature(estimator).parameters:
        sets = estimator_checks(partial(estimator, correspondence=False), ordered=False, accuracy=False)
        checks += [Check(f"as a set: {c.title}", c.run) for c in sets]
    return checks
