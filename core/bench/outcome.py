"""What a case gave, and when it counts as converged."""

from dataclasses import dataclass, field

#: What an outcome may be.
STATUSES = ("met", "MISS", "reported", "FAILED", "not claimed")
#: Relative change from the finest mesh below which a mesh counts as converged.
SETTLED = 0.01


@dataclass(frozen=True)
class Outcome:
    """One quantity of one case on one simulator.

    Args:
        test: name of the virtual test.
        group: of tests, for the summary.
        kind: of body.
        label: of the case.
        quantity: measured.
        unit: of it.
        asked: its value by the material or a closed form, or None.
        goal: largest error, or None.
        cells: what the meshes count.
        meshes: that ran, rising.
        delivered: on each of them, in ``unit``.
        seconds: of this process that each took.
        reason: why it, or the next mesh, was not measured; empty if nothing went wrong.
        claimed: False if the simulator does not claim to do this.
    """

    test: str
    group: str
    kind: str
    label: str
    quantity: str
    unit: str
    asked: float | None
    goal: float | None
    cells: str
    meshes: list[int] = field(default_factory=list)
    delivered: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    reason: str = ""
    claimed: bool = True

    @property
    def errors(self) -> list[float]:
        """Relative error on each mesh, or the value itself where zero is asked; empty if nothing is asked."""
        if self.asked is None:
            return []
        return [d / self.asked - 1.0 if self.asked else d for d in self.delivered]

    @property
    def error(self) -> float | None:
        """That of the finest mesh."""
        return self.errors[-1] if self.errors else None

    @property
    def within_from(self) -> int | None:
        """The coarsest mesh from which on every one is within the goal; None if the finest is not."""
        if self.goal is None:
            return None
        goal = self.goal
        return self._from([abs(e) <= goal for e in self.errors])

    @property
    def settled_from(self) -> int | None:
        """The coarsest mesh from which on nothing changes by more than :data:`SETTLED` up to the finest.

        None if only the finest is so near to itself, or only one was run.
        """
        if len(self.delivered) < 2:
            return None
        last = self.delivered[-1]
        found = self._from([abs(d - last) <= SETTLED * abs(last) for d in self.delivered])
        return None if found == self.meshes[-1] else found

    @property
    def status(self) -> str:
        """Of :data:`STATUSES`: ``reported`` if nothing is asked, ``FAILED`` if it ran on no mesh."""
        if not self.claimed:
            return "not claimed"
        if not self.delivered:
            return "FAILED"
        if self.goal is None:
            return "reported"
        return "MISS" if self.within_from is None else "met"

    def to_json(self) -> dict[str, object]:
        """Everything, what follows included."""
        derived = {k: getattr(self, k) for k in ("status", "error", "errors", "within_from", "settled_from")}
        return {**self.__dict__, **derived}

    def _from(self, good: list[bool]) -> int | None:
        found = None
        for mesh, fine in zip(reversed(self.meshes), reversed(good), strict=True):
            if not fine:
                break
            found = mesh
        return found


def summary(outcomes: list[Outcome]) -> str:
    """One line: the worst error of every group on the finest meshes, from which mesh on its goals are met, and counts.

    Meshes are counted by each test in its own way; the largest of these counts is given.
    """
    parts = []
    for group in dict.fromkeys(o.group for o in outcomes):
        mine = [o for o in outcomes if o.group == group]
        count = {status: sum(o.status == status for o in mine) for status in STATUSES}
        errors = [abs(e) for o in mine if o.goal is not None and o.asked and (e := o.error) is not None]
        text = f"{group} {100 * max(errors):.2g} % worst" if errors else group
        meshes = sorted({m for o in mine if (m := o.within_from) is not None})
        if meshes and count["MISS"] == 0:
            text += f", met from {meshes[-1]} cells on" if len(meshes) > 1 else ""
        told = ", ".join(f"{count[s]} {s}" for s in STATUSES if count[s])
        parts.append(f"{text} ({told})")
    return "; ".join(parts)
