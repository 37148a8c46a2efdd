"""A network that learns what the fitted model gets wrong: how small a held-out error can be without a name."""

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.measurement import Recording
from muslin.core.rollout import Trajectory
from muslin.core.study import Task

from .trial import Answer, Trial

#: Hidden units of each of two layers, and the epochs at most.
UNITS, EPOCHS = 64, 300
#: Every so many frames go to the validation that ends the training, in runs of this length.
EVERY, RUN = 20, 5


def residual_network(trial: Trial) -> Answer:
    """Learns residuals of the fitted motions from what the model predicts, and adds them on the held-out ones.

    It sees, of every marker and frame, which marker it is, where it is from the hand, and how both move.
    """
    import torch

    space = trial.study.problem.space
    values = space.as_dict(space.from_unit(trial.unit))
    names = [*trial.problem.fit_on, *trial.problem.hold_out]
    outcomes = list(trial.pool.map([Task(values, n) for n in names]))
    if not all(isinstance(o, Trajectory) for o in outcomes):
        return Answer(None)
    rows = {
        n: _rows(trial.problem.recordings[n], o)
        for n, o in zip(names, outcomes, strict=True)
        if isinstance(o, Trajectory)
    }
    x, y, t = (np.concatenate([rows[n][k] for n in trial.problem.fit_on]) for k in range(3))
    centre, spread, size = x.mean(axis=0), x.std(axis=0) + 1e-9, y.std() + 1e-9
    left_out = (t % EVERY) < RUN
    torch.manual_seed(trial.case.seed)
    net = torch.nn.Sequential(
        torch.nn.Linear(x.shape[1], UNITS),
        torch.nn.SiLU(),
        torch.nn.Linear(UNITS, UNITS),
        torch.nn.SiLU(),
        torch.nn.Linear(UNITS, 3),
    )
    inputs = torch.tensor((x - centre) / spread, dtype=torch.float32)
    wanted = torch.tensor(y / size, dtype=torch.float32)
    held = torch.tensor(left_out)
    optimizer = torch.optim.AdamW(net.parameters(), lr=3e-3, weight_decay=1e-3)
    best, state = float((wanted[held] ** 2).mean()), None  # of no correction at all
    for _ in range(EPOCHS):
        optimizer.zero_grad()
        loss = ((net(inputs[~held]) - wanted[~held]) ** 2).mean()
        loss.backward()  # type: ignore[no-untyped-call]
        optimizer.step()
        with torch.no_grad():
            now = float(((net(inputs[held]) - wanted[held]) ** 2).mean())
        if now < best:
            best, state = now, {k: v.clone() for k, v in net.state_dict().items()}
    if state is not None:
        net.load_state_dict(state)
    squares = []
    for name in trial.problem.hold_out:
        its, true, _ = rows[name]
        with torch.no_grad():
            made = net(torch.tensor((its - centre) / spread, dtype=torch.float32)).numpy() * size
        squares.append(float(np.mean((true - (made if state is not None else 0.0)) ** 2)))
    return Answer(None, float(np.sqrt(np.mean(squares))))


def _rows(recording: Recording, model: Trajectory) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What is known ``(N, F)`` and what the model lacks ``(N, 3)`` [m] of seen markers, and their frames ``(N,)``."""
    times, points = recording.series.time, model.series.points
    frames, count = points.shape[:2]
    hand = np.repeat(model.poses[:, :1, :3], count, axis=1)
    known = [points - hand]
    for series in (points, hand):
        speed = np.gradient(series, times, axis=0)
        known += [speed, np.gradient(speed, times, axis=0)]
    place = np.broadcast_to(np.linspace(-1, 1, count)[None, :, None], (frames, count, 1))
    features = np.concatenate([*known, place, place**2], axis=2)
    seen = recording.series.valid
    frame = np.broadcast_to(np.arange(frames)[:, None], seen.shape)
    return features[seen], (recording.series.points - points)[seen], frame[seen].astype(np.float64)
