"""The next experiment in words."""

from typing import Any

#: From this probability on a motion is said to tell models apart.
TELLS = 0.5
#: Takes are counted to this probability.
SURE = 0.9


def explain(result: dict[str, Any], limits: str) -> list[str]:
    """Paragraphs for people: what is open, what to do, and how sure one would be after it.

    Args:
        result: the JSON of the step.
        limits: in words.
    """
    names, purpose = result["effects"], result["purpose"]
    if purpose == "nothing":
        return [f"No motion is proposed: {result['reason']}."]
    what = "Tied now" if purpose == "tied" else "Not visible in these data"
    beside = f", with {' and '.join(result['beside'])} in the model" if result["beside"] else ""
    out = [f"{what}: {', '.join(names)}{beside}."]
    motion = result["motion"]
    if motion is None:
        out.append(
            f"No motion is proposed: none of the {result['tried']} tried within these limits could be simulated."
        )
        return [*out, _limits(limits)]
    if purpose == "tied":
        out.append(_tied(result))
    else:
        out += _unseen(result)
    out.append(_motion(result))
    if not result["correspondence"]:
        out.append("Points that nothing tells apart show less than this, which takes each of them for known.")
    return [*out, _limits(limits)]


def percent(probability: float) -> str:
    """Never surer than what was counted."""
    return "less than 1 %" if probability < 0.005 else f"{min(100 * probability, 99):.0f} %"


def _tied(result: dict[str, Any]) -> str:
    best, motion, repeat = result["probability"], result["motion"], result["repeat"]
    again = f" ({repeat['name']}: {percent(repeat['probability'])})" if repeat else ""
    if best < TELLS:
        text = f"No motion within these limits would tell them apart: best {percent(best)}{again}, {motion['name']}."
    else:
        text = (
            f"Proposed: {motion['name']}. After it the right one would be named with probability {percent(best)} or "
            f"more, whichever it is{again}."
        )
    if best < SURE:
        takes = result["takes"]
        text += f" {takes} takes of it would do with {percent(SURE)}." if takes else " Nor would many takes of it."
    return text


def _unseen(result: dict[str, Any]) -> list[str]:
    shares = result["probabilities"]
    seen = {n: p for n, p in shares.items() if p >= TELLS}
    hidden = sorted(set(shares) - set(seen))
    out = []
    if seen:
        told = ", ".join(f"{n} ({percent(p)})" for n, p in sorted(seen.items(), key=lambda x: -x[1]))
        out.append(
            f"Proposed: {result['motion']['name']}. Of effects of typical strength, a quarter of their range, it would "
            f"show {told}."
        )
    else:
        out.append(f"No motion within these limits would show any of them; the best is {result['motion']['name']}.")
    if seen and hidden:
        out.append(f"It would not show: {', '.join(f'{n} ({percent(shares[n])})' for n in hidden)}.")
    return out


def _motion(result: dict[str, Any]) -> str:
    m = result["motion"]
    turning = f", turning by up to {57.29578 * m['turn']:.0f}°" if m["turn"] > 0 else ""
    return (
        f"It takes {m['duration']:.2g} s at {m['rate']:g} Hz from the pose where the recordings start, with a peak "
        f"speed of {m['peak_speed']:.2f} m/s and acceleration of {m['peak_acceleration']:.1f} m/s²{turning}."
    )


def _limits(limits: str) -> str:
    return f"Limits: {limits}."
