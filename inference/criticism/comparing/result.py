"""What a comparison found: in a table, in words, and as JSON."""

from dataclasses import asdict, dataclass
from typing import Any

from ..caveats import ELSEWHERE
from .adequacy import Adequacy
from .excess import Group

#: A model is further off than none only if it is so many times the noise off, too.
ASTRAY = 2.0


@dataclass(frozen=True)
class Row:
    """One recording. Errors are root mean squares over coordinates [unit].

    Args:
        recording, role: its name, and ``"fit"`` or ``"held-out"``.
        rmse: of the best fit.
        noise: of the measurement.
        scatter: of predictions over posterior draws.
        baseline: of the first measured shape, carried along by the gripper.
        default: of the unfitted model, the middle of the prior.
        worst_time: when the best fit is farthest off [s].
        worst_point: which point is farthest off over all times.
        unit: of the errors.
        clock_offset: of the measurement, taken out [s].
        sets_beyond: share of frames whose points, taken as a set, are not those of the prediction under noise.
        sets_p_value: probability of sets so far apart in any frame under noise alone.
        sets_worst_time: when they are farthest apart [s].
    """

    recording: str
    role: str
    rmse: float
    noise: float
    scatter: float
    baseline: float
    default: float
    worst_time: float
    worst_point: int
    unit: str
    clock_offset: float
    sets_beyond: float
    sets_p_value: float
    sets_worst_time: float


@dataclass(frozen=True)
class Comparison:
    """What :func:`~..compare.compare` found.

    Args:
        rows: a row a recording.
        adequacy: the test of the fitted recordings.
        groups: errors by recording, phase, contact, distance from the grasp, and place.
        where: the same in a sentence.
        sets: a sentence on points without correspondence; "" where all correspond.
        in_pieces: that fitted recordings are predicted in pieces, in a sentence; "" where they are not.
    """

    rows: tuple[Row, ...]
    adequacy: Adequacy
    groups: tuple[Group, ...]
    where: str
    sets: str
    in_pieces: str = ""

    @property
    def p_value(self) -> float:
        """Probability of a misfit at least this large on the fitted recordings if model and noise were right."""
        return self.adequacy.p_value

    @property
    def adequate(self) -> bool:
        """The p value is not significant."""
        return self.adequacy.adequate

    @property
    def elsewhere(self) -> str:
        """That held-out recordings are far off, which the test of the fitted ones does not see; "" where they are not.

        Of a model that is not adequate anyway nothing more is said.
        """
        held = {r.recording for r in self.rows if r.role == "held-out"}
        times = {g.name: g.rmse / g.expected for g in self.groups if g.partition == "recording" and g.name in held}
        off = [name for name, ratio in times.items() if ratio > ELSEWHERE]
        if not self.adequate or not off:
            return ""
        worst = max(off, key=times.__getitem__)
        return (
            f"But held-out recordings are far off ({len(off)} of {len(held)}; most {worst}, {times[worst]:.1f} times "
            "what noise gives): fit on one of them too ([study] fit_on), and compare again; if it is not adequate "
            "then, muslin diagnose asks what it lacks."
        )

    @property
    def astray(self) -> str:
        """That the model is further off than none where it was fitted; "" where it is not.

        Held-out recordings do not count: there a fit that made up for a missing effect may well be further off.
        """
        fitted = [r for r in self.rows if r.role == "fit"]
        worse = [r.recording for r in fitted if r.rmse > max(r.baseline, ASTRAY * r.noise)]
        if self.adequate or 2 * len(worse) <= len(fitted):
            return ""
        return (
            f"On {len(worse)} of the {len(fitted)} fitted recordings ({', '.join(worse[:3])}"
            f"{' …' if len(worse) > 3 else ''}) the model is further off than the first measured shape carried along "
            "by the gripper (baseline). Before physics is missed, look at where the object starts, at its size, and at "
            "what each gripper holds ([scenario] in the study file; muslin report shows it)."
        )

    def text(self) -> str:
        """A table and a few sentences for people."""
        unit, factor = ("mm", 1e3) if self.rows[0].unit == "m" else (self.rows[0].unit, 1.0)
        wide = max(20, *(len(r.recording) for r in self.rows))
        titles = "".join(f" {t:>{w}}" for t, w in (("error", 8), ("noise", 8), ("scatter", 8), ("baseline", 9)))
        head = f"{'recording':<{wide}} {'role':<9}{titles} {'unfitted':>9}"
        lines = [f"{head}  worst at   [{unit}, root mean square a coordinate]"]
        for r in self.rows:
            cells = "".join(
                f" {factor * v:>{w}.2f}"
                for v, w in ((r.rmse, 8), (r.noise, 8), (r.scatter, 8), (r.baseline, 9), (r.default, 9))
            )
            lines.append(f"{r.recording:<{wide}} {r.role:<9}{cells}  {r.worst_time:.2f} s, point {r.worst_point}")
        verdict = " ".join(s for s in (self.adequacy.text(), self.elsewhere, self.astray) if s)
        return "\n".join([*lines, *(s for s in (self.in_pieces, self.where, self.sets, verdict) if s)])

    def to_json(self) -> dict[str, Any]:
        """Everything that was found, as plain values; lengths in the unit of the recordings."""
        return {
            "adequate": self.adequate,
            "p_value": self.p_value,
            "replicates": self.adequacy.replicates,
            "limit": self.adequacy.limit,
            "signs": [asdict(s) for s in self.adequacy.signs],
            "elsewhere": self.elsewhere,
            "astray": self.astray,
            "where": self.where,
            "sets": self.sets,
            "in_pieces": self.in_pieces,
            "groups": [asdict(g) for g in self.groups],
            "rows": [asdict(r) for r in self.rows],
        }


def pieces_sentence(pieces: float) -> str:
    """How recordings that were cut into so many ``pieces`` in the mean are told of; "" if they were not."""
    if pieces == 1.0:
        return ""
    return (
        f"Fitted recordings are predicted in pieces ({pieces:.2g} of each, in the mean), each from where it starts; "
        "held-out ones in one go."
    )


def sets_sentence(rows: tuple[Row, ...]) -> str:
    """What the recordings without correspondence show, taken as sets."""
    off = [r for r in rows if r.sets_p_value <= 0.05]
    if not off:
        return "Taken as sets, the measured points are those of the prediction under noise, in every frame."
    told = ", ".join(f"{100 * r.sets_beyond:.0f} % of {r.recording} (most at {r.sets_worst_time:.2f} s)" for r in off)
    return f"Taken as sets, measured points differ from the prediction by more than noise in these frames: {told}."
