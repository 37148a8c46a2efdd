"""What a reader of a diagnosis must know besides its verdict: what is left, was not looked into, or cannot be seen."""

from typing import Any

import numpy as np

#: What to do where the numbers of the model count.
_FINER = {"step": "lower [simulator] time_step", "mesh": "raise [scenario] vertices"}
#: A held-out error of so many times the noise is told where the fitted recordings show no misfit.
ELSEWHERE = 1.5


def small(result: dict[str, Any]) -> str:
    """That what is missing hides behind the noise, though it is there."""
    if result["verdict"] not in ("named", "tied") or result["evidence"]["beyond_noise"]:
        return ""
    best = next(c for c in result["candidates"] if c["name"] == result["effects"][0])
    borne_out = result["error"]["held_out"] and result["error"]["after"] < result["error"]["before"]
    return (
        f"It is small: without it the model is within what noise may leave in all; but what {best['name']} takes away "
        f"is beyond chance ({best['z']:.0f} standard deviations)"
        + (", and motions that were not fitted bear it out." if borne_out else ".")
    )


def further(result: dict[str, Any]) -> str:
    """That one of several effects is missing beside those that were named, or one beside any of several."""
    several = result["further"]
    if not several:
        return ""
    if result["verdict"] == "tied":
        return f"Something more is missing, whichever of {', '.join(result['effects'])} it is: {' and '.join(several)}."
    return (
        f"Something more is missing beside {' and '.join(result['effects'])}: one of {', '.join(several)}; these data "
        "cannot tell which."
    )


def rest(result: dict[str, Any]) -> str:
    """That something is left beside what was named is no reason to doubt the name, but to go on."""
    if result["rest"] is None:
        return ""
    left = f"{result['evidence']['misfit_after'] ** 0.5:.2f} times the noise"
    if result["rest"] == "none":
        return f"More is missing: the fitted recordings are still {left} off, and no further candidate explains that."
    if result["rest"] == "open":
        them = "it" if len(result["effects"]) == 1 else "them"
        return (
            f"More may be missing: the fitted recordings are still {left} off, which was not looked into with "
            f"{' and '.join(result['effects'])} in the model; add {them}, and diagnose again."
        )
    return (
        f"More may be missing: the fitted recordings are still {left} off, and the budget ended after "
        f"{result['simulations']} simulations, before that was looked into; allow more ([diagnose] simulations)."
    )


def budget(result: dict[str, Any]) -> str:
    """That more simulations may say more."""
    if not result["budget_spent"] or result["verdict"] not in ("none", "tied"):
        return ""
    return (
        f"The budget cut the search short, after {result['simulations']} simulations: with more of them "
        "([diagnose] simulations) a candidate may come nearer."
    )


def elsewhere(result: dict[str, Any]) -> str:
    """What a fit without a misfit still does not say: how the model does on other motions."""
    error = result["error"]
    if result["verdict"] not in ("no-misfit", "cannot-tell") or result["unfinished"] or not error["held_out"]:
        return ""
    ratio = result["evidence"]["held_out"] ** 0.5
    if np.isnan(ratio) or ratio < ELSEWHERE:
        return ""
    if np.isinf(ratio):
        return "But held-out motions cannot be simulated with what was fitted, so nothing is said of them."
    return (
        f"But on held-out motions the model is {ratio:.1f} times the noise off, beyond what its numerics and chance "
        "explain: what is missing shows there. Fit on one of them too ([study] fit_on), and diagnose again."
    )


def numerics(result: dict[str, Any]) -> str:
    """Where a misfit stays, whether the numbers of the model are good enough to speak of one."""
    error = result["error"]
    large = {what: size for what, size in result["numerics"].items() if size > error["noise"]}
    if not large or (result["verdict"] != "none" and result["rest"] is None):
        return ""
    names = {"step": "half the time step", "mesh": "a finer mesh"}
    told = ", ".join(
        f"{names.get(what, f'the engine {what}')} by {length(size, error['unit'])}" for what, size in large.items()
    )
    advice = " and ".join(a for what, a in _FINER.items() if what in large)
    more = f" {advice[0].upper()}{advice[1:]} until that no longer counts, and diagnose again." if advice else ""
    return f"The model's own numbers move it by more than the noise: {told}; what stays may be theirs.{more}"


def unrepeatable(result: dict[str, Any]) -> str:
    """What was measured and not used."""
    loose = result["unrepeatable"]
    if not loose:
        return ""
    where = "; ".join(loose)
    return f"Left to chance: next to nothing in the parameters moves {where}; what is measured there does not count."


def invisible(result: dict[str, Any]) -> str:
    """The candidates of which these data say nothing; what is told of was strong enough to be seen."""
    told = (*result["effects"], *result["further"])
    hidden = sorted(c["name"] for c in result["candidates"] if c["identifiability"] == 0.0 and c["name"] not in told)
    return f"Not visible in these data, so neither ruled in nor out: {', '.join(hidden)}." if hidden else ""


def untried(result: dict[str, Any]) -> str:
    """The candidates that the budget did not come to, of those that these data show: nothing rules them out."""
    if not result["budget_spent"] or result["verdict"] not in ("named", "tied", "none"):
        return ""
    told = (*result["effects"], *result["further"])
    left = [c for c in result["candidates"] if not c["tried"] and c["identifiability"] > 0.0]
    names = sorted(c["name"] for c in left if c["name"] not in told)
    if not names:
        return ""
    return (
        f"Not tried, as the budget ended after {result['simulations']} simulations: {', '.join(names)}; allow more "
        "([diagnose] simulations), and diagnose again."
    )


def length(value: float, unit: str) -> str:
    """A length for people: millimetres for metres."""
    return f"{1e3 * value:.1f} mm" if unit == "m" else f"{value:.2f} {unit}"
