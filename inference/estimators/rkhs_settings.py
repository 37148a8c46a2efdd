"""Options of ``bayessim-rkhs``, and the presets they start from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Every option of ``bayessim-rkhs`` with the default for small budgets on two cores.

    Args:
        features: M, random Fourier features of the RKHS layer.
        bandwidth: where the learned bandwidth starts [standardised coordinates].
        components: Gaussians of a mixture.
        hidden: widths of the fully connected layers on trajectories.
        learning_rate: of Adam, for the network on trajectories.
        max_epochs, patience: of the network on trajectories; patience 0 trains all epochs on all draws.
        batch: draws a gradient step.
        frames: frames a recording the trajectory network sees, evenly spread; 0 for all.
        points: points a frame it sees, evenly spread in their sorted order; 0 for all.
        summaries: whether the posterior comes from the second stage, on summaries of all frames.
        principal: principal components kept of each kind of summary.
        shown: of these, how many the second stage's networks read beside the regression.
        summary_hidden, summary_learning_rate, summary_decay, summary_epochs, summary_patience, summary_batch: of
            the second stage.
        members: networks of the second stage, each leaving another part of the draws out.
        threads: torch threads during training.
    """

    features: int = 64
    bandwidth: float = 1.0
    components: int = 4
    hidden: tuple[int, ...] = (64,)
    learning_rate: float = 3e-3
    max_epochs: int = 25
    patience: int = 8
    batch: int = 64
    frames: int = 8
    points: int = 64
    summaries: bool = True
    principal: int = 40
    shown: int = 8
    summary_hidden: tuple[int, ...] = (32, 32)
    summary_learning_rate: float = 3e-3
    summary_decay: float = 1e-4
    summary_epochs: int = 200
    summary_patience: int = 15
    summary_batch: int = 128
    members: int = 5
    threads: int = 1


PRESETS: dict[str, Settings] = {
    "default": Settings(),
    # 3 x 1024, Adam at 1e-6, 4 components, embedding and density trained as one network on all frames: the paper's.
    # It names no number of updates and no number of features; bayes-sim-ig runs 10 000 updates, MDRFF has 200.
    "paper": Settings(
        features=200,
        hidden=(1024, 1024, 1024),
        learning_rate=1e-6,
        max_epochs=2000,
        patience=0,
        frames=0,
        points=0,
        summaries=False,
    ),
}
