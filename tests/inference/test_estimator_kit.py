"""The kit of estimators passes what is right and fails, with a sentence, what is broken in one way."""

from functools import partial

import faulty_estimators as faulty
import pytest
from faulty_estimators import Wrong
from right_estimator import Right

from muslin.core.testing import KITS, check_estimator
from muslin.core.testing.checks import run_all
from muslin.core.testing.estimators import estimator_checks

#: Title of a check -> faulty estimators, each with words of the complaint.
FAULTS: dict[str, dict[type[Right], str]] = {
    "samples and density have their shapes and support": {
        Wrong.of(faulty.Leaking): "lie outside the unit cube",
        Wrong.of(faulty.Boundless): "log_prob outside the unit cube is",
    },
    "the density integrates to one": {Wrong.of(faulty.Unnormalised): "integrates to 1.1"},
    "samples follow the density": {
        Wrong.of(faulty.Tempered): "times as wide as log_prob says",
        Wrong.of(faulty.Elsewhere): "standard deviations off the mean of log_prob",
        Wrong.of(faulty.Repeating): "of 10000 samples repeat others",
    },
    "10 000 samples in a second": {Wrong.of(faulty.Slow): "processor seconds, more than 1"},
    "a saved posterior comes back to the bit": {
        Wrong.of(faulty.Forgetful): "changed between save and load",
        Wrong.of(faulty.Pickled): "'mass' of the saved file holds a pickle",
        Wrong.of(faulty.Renamed): "under the name that was given",
    },
    "repeats bit for bit": {
        faulty.Unseeded: "same draws and seed differ",
        faulty.Warm: "depends on what was fitted before",
    },
    "global random state untouched": {
        faulty.GlobalNumpy: "numpy's global random state",
        faulty.GlobalPython: "the random module's global state",
    },
    "leaves what it is given as it is": {
        faulty.WritesDraws: "the caller's theta was written to",
        faulty.WritesMeasurement: "the caller's the measurement was written to",
    },
    "says so when asked before fit": {
        faulty.Eager: "it gives a posterior before fit",
        faulty.Absent: "TypeError instead of StepMissingError",
    },
    "refuses too few draws": {
        faulty.Careless: "three draws are accepted",
        faulty.Strict: "RuntimeError instead of InputError",
    },
    "refuses failed draws": {
        faulty.Careless: "all-NaN draws are accepted",
        faulty.Strict: "RuntimeError instead of InputError",
    },
    "draws that tell nothing give the prior": {faulty.Certain: "the prior has 0.289"},
    "reads points that are missing": {faulty.Brittle: "NaN"},
    "reads every recording": {
        faulty.OneRecording: "one that reads only one of them",
        faulty.AnyRecordings: "too few recordings in a measurement are accepted",
    },
    "honours importance weights": {faulty.Weightless: "towards where the draws are"},
    "stays proper at the prior's bounds": {
        Wrong.of(faulty.Clipped): "as if they were clipped",
        Wrong.of(faulty.Uncut): "integrates to 0.",
        faulty.Shy: "in a corner of the prior",
    },
    "recovers a known posterior": {
        faulty.Shifted: "exact standard deviations off",
        faulty.Overconfident: "times the exact ones",
    },
    "is as often right as it says": {faulty.Overconfident: "80 % intervals hold the truth in"},
}
SET_FAULTS: dict[str, dict[type[Right], str]] = {
    "the order of points has no influence": {
        faulty.Ordered: "permuting the points of the measurement",
        faulty.OrderedTraining: "permuting the points of the training draws",
    },
    "reads sets of every size": {faulty.FixedSize: "is refused"},
    "knows that more points tell more": {faulty.Sizeless: "for sets of 32 points"},
}


def complaint(estimator: type[Right], title: str, ordered: bool) -> str | None:
    checks = estimator_checks(partial(estimator, correspondence=ordered), ordered=ordered)
    [(_, told)] = run_all([c for c in checks if c.title == title])
    return told


@pytest.mark.parametrize("ordered", [True, False])
def test_an_estimator_that_is_right_passes(ordered: bool) -> None:
    check_estimator(partial(Right, correspondence=ordered), ordered=ordered)


@pytest.mark.parametrize(("title", "estimator"), [(t, e) for t, faults in FAULTS.items() for e in faults])
def test_each_check_catches_an_estimator_broken_in_just_that_way(title: str, estimator: type[Right]) -> None:
    told = complaint(estimator, title, ordered=True)
    assert told is not None
    assert FAULTS[title][estimator] in told


@pytest.mark.parametrize(("title", "estimator"), [(t, e) for t, faults in SET_FAULTS.items() for e in faults])
def test_each_check_of_sets_catches_an_estimator_broken_in_just_that_way(title: str, estimator: type[Right]) -> None:
    told = complaint(estimator, title, ordered=False)
    assert told is not None
    assert SET_FAULTS[title][estimator] in told


def test_no_check_of_the_kit_goes_without_a_fault_that_it_catches() -> None:
    ordered, sets = ({c.title for c in estimator_checks(Right, ordered=o)} for o in (True, False))
    assert ordered == set(FAULTS)
    assert sets - ordered == set(SET_FAULTS)


def test_every_failure_is_told_of_at_once_and_what_is_not_promised_is_left_out() -> None:
    with pytest.raises(AssertionError, match=r"right breaks 2 promise\(s\)") as raised:
        check_estimator(faulty.Overconfident)
    assert "recovers a known posterior" in str(raised.value)
    check_estimator(faulty.Overconfident, accuracy=False)


def test_the_command_line_checks_points_that_correspond_and_sets_of_them() -> None:
    titles = [c.title for c in KITS["estimator"](Right)]
    assert "recovers a known posterior" in titles
    assert "as a set: the order of points has no influence" in titles


def test_an_estimator_without_that_option_is_checked_as_it_is() -> None:
    class Plain(Right):
        def __init__(self) -> None:
            super().__init__()

    assert not any("as a set" in c.title for c in KITS["estimator"](Plain))
