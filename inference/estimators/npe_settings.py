"""Options of ``npe-rkhs``, and the presets they start from."""

from dataclasses import dataclass

from ..density.ensemble import Schedule
from ..density.trajectory_features import TimePlan


@dataclass(frozen=True)
class Settings:
    """Every option of ``npe-rkhs`` with the default for 100 to 10 000 draws.

    Args:
        heads: densities that are tried, of ``mixture`` and ``flow``, with a plus sign between them.
        members: networks of each head, each with draws of its own left out.
        held_out: part of the draws that a member leaves out.
        coordinates: ``auto``, or one of :class:`~..density.coordinates.Coordinates`.
        components: Gaussians of a mixture.
        hidden: widths of every network's fully connected layers.
        transforms, bins: of the spline flow.
        learning_rate, weight_decay, patience: of the ensembles.
        epochs: of the ensembles at 1 000 draws or fewer; fewer the more draws.
        batch: draws a step at most; a tenth of the draws if that is less, but at least 32.
        shown: columns of features that the networks read at most.
        principal: principal components of what is too long to be read entry by entry.
        kernel_features, bandwidth: random Fourier features of the RKHS layer and where its bandwidth starts.
        width, learned: numbers a frame and features of the time model.
        frames, points: how many the time model sees of a recording and of a frame; 0 for all.
        time_epochs: of the time model; 0 leaves it out.
        device: ``auto``, ``cpu`` or ``cuda``.
        threads: torch threads during training.
    """

    heads: str = "mixture+flow"
    members: int = 5
    held_out: float = 0.1
    coordinates: str = "auto"
    components: int = 8
    hidden: tuple[int, ...] = (64, 64)
    transforms: int = 2
    bins: int = 8
    learning_rate: float = 1e-2
    weight_decay: float = 1e-2
    patience: int = 8
    epochs: int = 60
    batch: int = 256
    shown: int = 40
    principal: int = 40
    kernel_features: int = 32
    bandwidth: float = 1.0
    width: int = 32
    learned: int = 16
    frames: int = 16
    points: int = 64
    time_epochs: int = 20
    device: str = "auto"
    threads: int = 1

    def schedule(self, draws: int) -> Schedule:
        """Of an ensemble on so many draws."""
        fewer = min(1.0, (1000.0 / draws) ** 0.25)
        batch = max(32, min(self.batch, draws // 10))
        return Schedule(self.learning_rate, self.weight_decay, batch, max(1, round(self.epochs * fewer)), self.patience)

    @property
    def time_plan(self) -> TimePlan:
        """Of the time model."""
        return TimePlan(
            self.kernel_features, self.bandwidth, self.width, self.learned, 4, self.frames, self.points,
            3e-3, 1e-4, 64, self.time_epochs, 6,
        )  # fmt: skip


PRESETS: dict[str, Settings] = {
    "default": Settings(),
    # What the paper has of it: the RKHS embedding under one mixture of four Gaussians in probit coordinates.
    "paper": Settings(heads="mixture", members=1, components=4, coordinates="probit"),
}
