"""A classifier that has seen many simulated draws, with every effect and with none."""

import os
from pathlib import Path

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.rollout import Trajectory
from muslin.core.study import Task

from ..cases import CORRELATION
from .sindy import filled
from .trial import Answer, Trial

#: Principal components that the network sees, and its hidden layers.
COMPONENTS, LAYERS = 60, (128, 64)


def amortised(trial: Trial) -> Answer:
    """Bayesian model comparison by simulation: uniform over the models, priors of the study within each.

    The draws of a setting and its motions are simulated once and serve all its cases; noise and gaps of the case's own
    measurement are laid over them. Principal components and a perceptron say which model a measurement is of.
    """
    from sklearn.decomposition import PCA
    from sklearn.neural_network import MLPClassifier

    points, labels = _draws(trial)
    rng = np.random.default_rng([trial.case.seed, 71])
    rows = np.stack([_flat(trial, _flawed(trial, row, rng)) for row in points])
    centre, scale = rows.mean(axis=0), rows.std()
    components = PCA(min(COMPONENTS, len(rows) - 1), random_state=0).fit((rows - centre) / scale)
    spread = components.transform((rows - centre) / scale)
    net = MLPClassifier(LAYERS, alpha=1e-3, max_iter=400, early_stopping=True, random_state=trial.case.seed)
    net.fit(spread / spread.std(axis=0), labels)
    measured = [trial.problem.recordings[n].series.points for n in trial.problem.fit_on]
    seen = components.transform((_flat(trial, measured)[None] - centre) / scale) / spread.std(axis=0)
    name = str(net.predict(seen)[0])
    return Answer(None if name == "none" else name)


def _draws(trial: Trial) -> tuple[list[list[FloatArray]], list[str]]:
    """Clean points of every draw, one array ``(T, P, 3)`` a recording, and the effect in it."""
    marks = f"{trial.case.setting}-{trial.case.role}-{trial.case.markers or 'all'}-{trial.draws}"
    path = trial.cache / f"{marks}.npz"
    if not path.exists():
        _simulate(trial, path)
    with np.load(path) as found:
        arrays = [found[f"points_{n}"] for n in trial.problem.fit_on]
        return [[a[k] for a in arrays] for k in range(len(arrays[0]))], found["labels"].tolist()


def _simulate(trial: Trial, path: Path) -> None:
    rng = np.random.default_rng([72, *trial.case.setting.encode(), *trial.case.role.encode()])
    names, recordings = [*trial.candidates, "none"], trial.problem.fit_on
    tasks, labels = [], []
    for k in range(trial.draws):
        name = names[k % len(names)]
        space = trial.problem.with_effects(*([] if name == "none" else [name])).space
        values = space.as_dict(space.from_unit(rng.random(len(space))))
        tasks += [Task(values, r) for r in recordings]
        labels.append(name)
    outcomes = iter(trial.pool.map(tasks))
    whole, kept = [], []
    for name in labels:
        its = [next(outcomes) for _ in recordings]
        if all(isinstance(o, Trajectory) for o in its):
            whole.append([o.series.points for o in its if isinstance(o, Trajectory)])
            kept.append(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays = {f"points_{r}": np.stack([w[k] for w in whole]).astype(np.float32) for k, r in enumerate(recordings)}
    half = path.with_suffix(f".{os.getpid()}.npz")  # another case may be making the same
    np.savez_compressed(half, labels=np.array(kept), **arrays)
    half.replace(path)


def _flawed(trial: Trial, row: list[FloatArray], rng: np.random.Generator) -> list[FloatArray]:
    out = []
    for name, clean in zip(trial.problem.fit_on, row, strict=True):
        wild = rng.normal(size=clean.shape)
        if trial.noise.ar1 > 0:
            for t in range(1, len(wild)):
                wild[t] = CORRELATION * wild[t - 1] + np.sqrt(1 - CORRELATION**2) * wild[t]
        points = clean + trial.noise.sd * wild
        points[~trial.problem.recordings[name].series.valid] = np.nan
        out.append(points)
    return out


def _flat(trial: Trial, row: list[FloatArray]) -> FloatArray:
    times = [trial.problem.recordings[n].series.time for n in trial.problem.fit_on]
    return np.concatenate([filled(p, t).ravel() for p, t in zip(row, times, strict=True)])
