"""The benchmark of hidden effects: that right and wrong are told apart."""

from typing import Any

import pytest
from effects import short, told
from effects_bench.scoring import SHARES, Share, judged, wilson
from effects_bench.table import Figure, figures, markdown


def record(
    kind: str, verdict: str, effects: tuple[str, ...], accepted: tuple[str, ...], **other: Any
) -> dict[str, Any]:
    rows = [
        {"name": n, "coefficients": {"c": {"mean": 1.1, "sd": 0.1, "unit": "1"}}} for n in (*effects, "wind", "hem")
    ]
    return {
        "case": {"kind": kind, "setting": "rope-air", "source": "same", "noise": 0.002} | other.pop("case", {}),
        "truth": {
            "accepted": accepted,
            "effects": accepted,
            "misfit": {a: 5.0 for a in accepted},
            "coefficients": {a: {"c": 1.0} for a in accepted},
        },
        "diagnosis": {
            "verdict": verdict,
            "effects": list(effects),
            "candidates": rows,
            "error": {"before": 0.008, "after": 0.002},
        },
        "failed": None,
        "simulations": 100,
        "seconds": 30.0,
        "processor_seconds": 40.0,
        "baselines": {},
    } | other


def share(name: str) -> Share:
    return next(s for s in SHARES if s.name == name)


def of(name: str, *records: dict[str, Any]) -> tuple[int, int]:
    return share(name).of(judged(records))


def test_wilson_intervals() -> None:
    assert wilson(50, 100) == pytest.approx((0.4038, 0.5962), abs=1e-4)
    assert wilson(10, 10)[0] == pytest.approx(10 / (10 + 1.96**2), abs=1e-4)
    assert wilson(0, 10)[1] == pytest.approx(1 - wilson(10, 10)[0])
    assert wilson(0, 0) == (0.0, 1.0)
    for hits in range(21):
        low, high = wilson(hits, 20)
        assert 0 <= low <= hits / 20 <= high <= 1


def test_a_first_guess_counts_though_it_is_not_named_but_not_as_a_name() -> None:
    shy = record("known", "none", (), ("wind",))
    assert of("top-1, rope", shy) == (1, 1)
    assert of("truth among the names given", shy) == (0, 1)
    wrong = record("known", "named", ("hem",), ("wind",))
    assert of("top-1, rope", shy, wrong) == (1, 2)
    assert of("right where one name is given", shy, wrong) == (0, 1)


def test_tied_is_right_only_if_it_is_said_and_the_truth_is_among_the_names() -> None:
    name = "'tied' where two look alike"
    assert of(name, record("tied", "tied", ("hem", "wind"), ("wind",))) == (1, 1)
    assert of(name, record("tied", "tied", ("hem", "crease"), ("wind",))) == (0, 1)
    assert of(name, record("tied", "named", ("wind",), ("wind",))) == (0, 1)
    assert of(name, record("tied", "none", (), ("wind",))) == (0, 1)


def test_poor_data_want_cannot_tell_and_no_misfit_claims_too_much() -> None:
    said = [record("poor", v, (), ("wind",)) for v in ("cannot-tell", "no-misfit")]
    assert of("'cannot-tell' where the data are poor", *said) == (1, 2)
    assert of("no name where the data are poor", *said) == (2, 2)
    assert of("no name where the data are poor", record("poor", "named", ("wind",), ("wind",))) == (0, 1)


def test_an_unknown_effect_wants_none_whatever_is_named_instead() -> None:
    name = "'none' where the effect is unknown"
    answers = (("none", ()), ("no-misfit", ()), ("named", ("wind",)), ("tied", ("wind", "hem")))
    assert of(name, *(record("unknown", v, e, ()) for v, e in answers)) == (1, 4)


def test_names_where_nothing_is_hidden_are_false_tied_ones_too() -> None:
    answers = (("no-misfit", ()), ("named", ("wind",)), ("tied", ("wind", "hem")))
    assert of("a name where nothing is hidden", *(record("none", v, e, ()) for v, e in answers)) == (2, 3)
    other = record("none", "named", ("wind",), (), case={"source": "other"})
    assert of("a name where nothing is hidden", other) == (0, 0)
    assert of("other engine: a name where nothing is hidden", other) == (1, 1)


def test_a_failed_case_is_wrong_and_one_that_was_never_made_is_nobodys() -> None:
    failed = {**record("known", "named", ("wind",), ("wind",)), "failed": "StoreError: disk full"}
    del failed["diagnosis"], failed["baselines"]
    made = {"case": failed["case"], "left_out": "nothing shows", "failed": None}
    assert of("top-1, rope", failed, made) == (0, 1)
    assert [f.value for f in figures([failed, made], ["bic"]) if f.name == "top-1, rope"] == [0.0]


def test_two_effects_are_right_only_if_both_are_named_and_no_third() -> None:
    answers = (("wind", "hem"), ("wind",), ("wind", "hem", "crease"))
    assert of("both of two effects named", *(record("two", "named", e, ("hem", "wind")) for e in answers)) == (1, 3)


def test_bars_intervals_and_rivals_are_in_the_table() -> None:
    records = [record("known", "named", ("wind",), ("wind",), baselines={"bic": {"name": "hem", "held_out": None}})] * 9
    records.append(record("known", "named", ("hem",), ("wind",)))
    found = {f.name: f for f in figures(records, ["bic"])}
    top = found["top-1, rope"]
    assert (top.value, top.count, top.met, top.rivals) == (0.9, 10, False, {"bic": 0.0})
    assert found["coefficients: 90 % intervals that hold the truth"].value == 1.0  # 1.1 +- 0.16 about 1.0
    assert found["coefficients: relative error, median"].value == pytest.approx(0.1)
    assert found["other engine: 90 % intervals that hold the truth"].count == 0
    for one in records:
        one["case"] = one["case"] | {"source": "other"}
    other = {f.name: f for f in figures(records, [])}["other engine: 90 % intervals that hold the truth"]
    assert (other.value, other.count) == (1.0, 9)
    over = found["held-out error over noise, median"]
    assert over.value == pytest.approx(1.0) and over.met
    assert found["top-1, cloth with contact"] == Figure(
        "top-1, cloth with contact", None, 0, 0.0, 1.0, ">= 97 %", None, {"bic": None}
    )
    text = markdown(list(found.values()), ["bic"])
    assert "| top-1, rope | 90.0 % | 10 | 59.6 to 98.2 % | >= 98 % | **missed** | 0.0 % |" in text


def test_what_the_results_keep_of_a_case() -> None:
    made = record("known", "tied", ("hem", "wind"), ("wind",))
    made["case"] |= {"seed": 3, "role": "a", "correlated": False, "dropouts": True}
    made["diagnosis"]["evidence"] = {"explained": 0.97}
    kept = short(made)
    assert kept["explained"] == 0.97
    assert (kept["verdict"], kept["effects"], kept["true_effects"]) == ("tied", ["hem", "wind"], ("wind",))
    assert kept["first"] == "hem" and kept["failed"] is None
    assert "wind (5.0 sd)" in told(made) and "tied: hem, wind" in told(made)
    left_out = {"case": made["case"], "left_out": "nothing shows", "failed": None}
    assert short(left_out)["left_out"] == "nothing shows" and "left out" in told(left_out)
    failed = {"case": made["case"], "truth": made["truth"], "failed": "StoreError: disk full"}
    assert short(failed)["failed"] == "StoreError: disk full" and "FAILED" in told(failed)
