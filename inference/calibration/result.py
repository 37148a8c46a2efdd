"""What a calibration found, as text, as JSON and in the store."""

from dataclasses import dataclass
from typing import Any

from ...core.arrays import FloatArray
from ...core.store import put, storage_errors
from ...core.study import Study
from ..posterior.files import fitted_space
from .predictive import Predictive
from .ranks import Ranks
from .verdict import Verdict, off


@dataclass(frozen=True, eq=False)
class Calibration:
    """What the step ``calibrate`` found.

    Args:
        verdict: on the ranks.
        ranks: of all cases.
        cases: where they come from, for people.
        predictive: one a recording; none if none were asked for.
        replicates: their discrepancies ``(R,)``, by recording.
        notes: what makes these numbers doubtful.
        simulations: rollouts that this took.
        seconds: that this took.
    """

    verdict: Verdict
    ranks: Ranks
    cases: str
    predictive: tuple[Predictive, ...]
    replicates: dict[str, FloatArray]
    notes: tuple[str, ...]
    simulations: int
    seconds: float

    def to_json(self) -> dict[str, Any]:
        """A table of plain values."""
        return {
            **self.verdict.to_json(),
            "sentences": self.verdict.sentences(),
            "from": self.cases,
            "predictive": [{**vars(p), "finding": p.finding} for p in self.predictive],
            "notes": list(self.notes),
            "simulations": self.simulations,
            "seconds": self.seconds,
        }

    def text(self) -> str:
        """The verdict, a line a parameter, and a line a recording."""
        lines = [f"The posterior is {s}" if k == 0 else f"and {s}" for k, s in enumerate(self.verdict.sentences())]
        if self.verdict.word == "cannot-tell":
            lines = [f"Calibration: {self.verdict.sentences()[0]}"]
        lines.append(f"  from {self.cases}")
        for r in self.verdict.rows:
            line = f"  {r.name}: 80 % hold {r.held:.0%} ({r.low:.0%} to {r.high:.0%})"
            if r.factor is not None:
                line += f", the truth {off(r)}, spread {r.factor:.2f} times the posterior's"
            lines.append(line + (f": {r.finding}" if r.finding else ""))
        if self.predictive:
            lines.append("Posterior predictive check:")
            lines += [f"  {p.text()}" for p in self.predictive]
        return "\n".join([*lines, *(f"  note: {n}" for n in self.notes)])


def save_calibration(study: Study, found: Calibration) -> None:
    """Write a calibration into the results of a study; the mark of its end comes last."""
    with storage_errors(study.results_path):
        group = study.results("r+").create_group("calibrate", overwrite=True)
        put(group, "rank", found.ranks.parameter, ["case", "parameter"], "1", "share of the marginal below the truth")
        put(group, "region_rank", found.ranks.region, ["case"], "1", "mass of the region on whose border the truth is")
        put(group, "tarp_rank", found.ranks.tarp, ["case"], "1", "mass nearer than the truth to a random point")
        put(group, "weight", found.ranks.weights, ["case"], "1", "what each case counts")
        for name, values in found.replicates.items():
            put(group, f"replicate_{name}", values, [f"replicate_{name}"], "1", "discrepancy of a replicate")
        group.attrs.update(
            {
                "parameters": list(fitted_space(study).names),
                "result": found.to_json(),
                "text": found.text(),
                "fingerprint": study.fingerprint("calibrate"),
            }
        )
        group.attrs["finished"] = True
