"""The five verdicts, from made-up evidence: each bar is what decides."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.criticism.candidate import Candidate, screening_points, z_value
from muslin.inference.criticism.held_out import HeldOut
from muslin.inference.criticism.verdict import MARGIN, SHARE_LEFT, Decision, Evidence, decide, has_misfit, objection
from muslin.inference.polish import Polished

COUNT = 3000.0


def candidate(
    name: str,
    rss: float,
    held_out: float = 0.003,
    coefficient: float = 0.5,
    sd: float = 0.01,
) -> Candidate:
    space = ParameterSpace((Parameter("stiffness", "Pa", 0, 1), Parameter(f"{name}.strength", "1", 0, 1)))
    white = np.full(int(COUNT), np.sqrt(rss / COUNT))
    fit = Polished(np.array([0.5, coefficient]), white, np.zeros((len(white), 2)), np.diag([1e-4, sd**2]), COUNT)
    return Candidate(name, space, 1, fit, {"other": held_out}, (held_out / 0.003) ** 2, refitted=True)


def evidence(rss: float, *candidates: Candidate, held_out: float = 0.010) -> Evidence:
    return Evidence(rss, COUNT, held_out, (held_out / 0.003) ** 2, 0.003, 0.01, candidates)


def test_named() -> None:
    e = evidence(9 * COUNT, candidate("drag", 1.02 * COUNT), candidate("wind", 6 * COUNT))
    assert decide(e) == Decision("named", ("drag",))
    assert e.explained(e.candidates[0]) == pytest.approx(1.0, abs=0.01)


def test_tied_when_rivals_are_within_the_margin() -> None:
    e = evidence(9 * COUNT, candidate("drag", 1.0 * COUNT), candidate("damping", 1.0 * COUNT + 6))
    assert decide(e) == Decision("tied", ("drag", "damping"))


def test_tied_when_the_difference_is_small_against_what_both_leave() -> None:
    """On data of another discretisation every difference is significant; the share left over says more."""
    e = evidence(9 * COUNT, candidate("drag", 2.0 * COUNT), candidate("damping", 2.3 * COUNT))
    assert decide(e).verdict == "tied"
    e = evidence(9 * COUNT, candidate("drag", 2.0 * COUNT), candidate("damping", 2.8 * COUNT))
    assert decide(e) == Decision("named", ("drag",))


def test_a_rival_just_below_what_is_asked_is_a_rival_still() -> None:
    above, below = candidate("drag", 2.4 * COUNT), candidate("damping", 2.8 * COUNT)
    e = evidence(9 * COUNT, above, below)
    assert objection(e, above) is None and objection(e, below) == "little"
    assert decide(e) == Decision("tied", ("drag", "damping"))
    assert decide(evidence(9 * COUNT, above, candidate("damping", 2.8 * COUNT, held_out=0.010))).verdict == "named"
    assert decide(evidence(9 * COUNT, above, candidate("damping", 2.8 * COUNT, coefficient=0.0))).verdict == "named"
    # of a misfit of a thousand, what the best leaves is far more than any difference in log likelihood
    vast = evidence(1400 * COUNT, candidate("slip", 30 * COUNT), candidate("offset", 750 * COUNT, sd=1e-5))
    vast = replace(vast, noise_error=0.03)
    assert decide(vast) == Decision("named", ("slip",))


def test_rivals_are_allowed_the_margin_beside_a_share_of_what_is_left() -> None:
    best = candidate("damping", 1.2 * COUNT)
    share = SHARE_LEFT * evidence(9 * COUNT, best).left(best)
    assert share > MARGIN
    between = candidate("drag", best.rss + share + MARGIN / 2)
    assert decide(evidence(9 * COUNT, best, between)).verdict == "tied"
    beyond = candidate("drag", best.rss + 2 * (share + MARGIN))
    assert decide(evidence(9 * COUNT, best, beyond)) == Decision("named", ("damping",))


def test_tied_when_the_noise_may_be_as_large_as_the_difference() -> None:
    """Two short repeats tell the noise to a third; what it may be is averaged over."""
    best, rival = candidate("damping", 1.0 * COUNT), candidate("drag", 1.0 * COUNT + 14)
    sure = evidence(9 * COUNT, best, rival)
    assert sure.behind(rival, best) == pytest.approx(14, rel=0.02)
    assert decide(sure) == Decision("named", ("damping",))
    few = replace(sure, count=50.0, noise_error=0.38)
    best, rival = (replace(c, fit=replace(c.fit, white=np.sqrt(rss / COUNT) * np.ones(int(COUNT)), count=50.0))
                   for c, rss in ((best, 80.0), (rival, 94.0)))  # fmt: skip
    vague = replace(few, rss_plain=9000.0, candidates=(best, rival))
    assert vague.behind(rival, best) == pytest.approx(53.5 * np.log(97.46 / 83.46), rel=0.01)
    assert decide(vague).verdict == "tied"
    assert decide(replace(vague, noise_error=0.01)) == Decision("named", ("damping",))


def test_not_named_when_much_is_left() -> None:
    """Another effect, one that is in no list, is for the most part mimicked by one that is."""
    most = candidate("wind", 3.2 * COUNT)
    assert evidence(9 * COUNT, most).explained(most) == pytest.approx(0.73, abs=0.01)
    assert decide(evidence(9 * COUNT, most, candidate("drag", 8 * COUNT))).verdict == "none"
    assert objection(evidence(9 * COUNT, most), most) == "little"


def test_nothing_is_ruled_out_that_was_not_refitted() -> None:
    looked_at = [replace(candidate(n, 9 * COUNT), refitted=False) for n in ("drag", "wind")]
    assert decide(evidence(9 * COUNT, *looked_at)) == Decision("cannot-tell", (), unfinished=True)
    assert decide(evidence(9 * COUNT, looked_at[0], candidate("wind", 9 * COUNT))).verdict == "none"
    promising = replace(candidate("drag", 1.02 * COUNT), refitted=False)
    assert decide(evidence(9 * COUNT, promising, candidate("wind", 9 * COUNT))).unfinished


def test_not_named_when_the_held_out_motion_gets_worse() -> None:
    assert decide(evidence(9 * COUNT, candidate("drag", 1.5 * COUNT, held_out=0.011))).verdict == "none"


def test_held_out_motions_that_would_not_show_an_effect_do_not_speak_against_it() -> None:
    """A gentle motion has its own noise, which no effect takes away."""
    shown = candidate("drag", 1.02 * COUNT, held_out=0.0031)
    e = evidence(9 * COUNT, shown, held_out=0.0031)
    assert decide(e).verdict == "none" and objection(e, shown) == "held-out"
    unseen = replace(shown, held_out_shift=2.0)
    assert decide(evidence(9 * COUNT, unseen, held_out=0.0031)) == Decision("named", ("drag",))


def test_an_effect_without_which_held_out_motions_cannot_be_simulated_may_be_named() -> None:
    e = evidence(9 * COUNT, candidate("drag", 1.02 * COUNT), held_out=np.inf)
    assert decide(e) == Decision("named", ("drag",))
    torn = candidate("drag", 1.02 * COUNT, held_out=np.inf)
    assert objection(evidence(9 * COUNT, torn, held_out=np.inf), torn) == "held-out"


def test_what_two_models_differ_by_on_held_out_motions() -> None:
    rng = np.random.default_rng(0)
    a = rng.normal(size=400)
    one, two = (HeldOut({"other": 0.003}, w, information=0.5, dropped=0) for w in (a, a + 0.1))
    assert one.shift(two) == pytest.approx(400 * 0.01)  # the residuals are worth as much as they are
    assert one.gain(two) == pytest.approx(float((a + 0.1) @ (a + 0.1) - a @ a)) == -two.gain(one)
    assert one.mean_square == pytest.approx(float(a @ a) / 200)
    assert HeldOut({"other": np.inf}, None, 1.0, 0).shift(one) == np.inf
    assert HeldOut({"other": np.inf}, None, 1.0, 0).gain(one) == 0.0
    assert HeldOut({"other": np.inf}, None, 1.0, 0).mean_square == np.inf
    assert np.isnan(HeldOut({}, None, 1.0, 0).mean_square)


@pytest.mark.parametrize(("gain", "verdict"), [(0.0, "no-misfit"), (MARGIN - 1, "no-misfit"), (MARGIN + 1, "named")])
def test_a_weak_effect_is_named_if_motions_that_were_not_fitted_bear_it_out(gain: float, verdict: str) -> None:
    """The total is within what the noise may be, and the gain significant, but not beyond doubt by itself."""
    weak = replace(candidate("wind", COUNT - 40, held_out=0.0029), held_out_gain=gain)
    e = evidence(COUNT + 10, weak, held_out=0.003)
    assert not has_misfit(e) and 4.0 < e.z(weak) < 8.0
    assert decide(e).verdict == verdict
    nothing_held_out = evidence(COUNT + 10, weak, held_out=np.nan)
    assert decide(nothing_held_out).verdict == "no-misfit"
    worse = replace(weak, held_out_white=1.1)
    assert decide(evidence(COUNT + 10, worse, held_out=0.003)).verdict == "no-misfit"


def test_not_named_when_the_coefficient_may_be_zero() -> None:
    assert decide(evidence(9 * COUNT, candidate("drag", 1.5 * COUNT, coefficient=0.01))).verdict == "none"


def test_no_misfit_and_cannot_tell_differ_in_what_the_data_could_show() -> None:
    seen, unseen = candidate("drag", COUNT - 1), candidate("lag", COUNT - 1, sd=0.3)
    assert decide(evidence(1.01 * COUNT, seen, seen)).verdict == "no-misfit"
    assert decide(evidence(1.01 * COUNT, unseen, unseen)).verdict == "cannot-tell"
    assert decide(evidence(1.01 * COUNT, seen, seen, unseen)).verdict == "no-misfit"
    assert decide(evidence(1.01 * COUNT, seen, unseen)).verdict == "cannot-tell"


def test_a_small_but_certain_effect_is_named() -> None:
    """Its misfit is within what the estimate of the noise may be off, but the gain cannot be chance."""
    e = evidence(1.10 * COUNT, candidate("tilt", 1.0 * COUNT, held_out=0.0030), held_out=0.0031)
    assert decide(e) == Decision("named", ("tilt",))


def test_significance_allows_for_what_is_left_and_for_how_many_were_tried() -> None:
    good, poor = candidate("a", COUNT), candidate("a", 4 * COUNT)
    assert z_value(COUNT + 30, good, 1) > z_value(COUNT + 30, good, 20)
    assert z_value(4 * COUNT + 30, poor, 1) < z_value(COUNT + 30, good, 1)
    assert z_value(COUNT, good, 1) == 0.0
    assert np.isfinite(z_value(1e9, good, 6))


def test_screening_covers_the_prior_of_the_coefficients() -> None:
    space = ParameterSpace((Parameter("stiffness", "Pa", 0, 1), Parameter("drag.strength", "1", 0, 1)))
    points = screening_points(space, 1, np.array([[0.3]]), 16, np.random.default_rng(0))
    assert points.shape == (16, 2)
    assert (points[::2, 0] == 0.3).all()
    assert np.ptp(points[:, 1]) > 0.8
