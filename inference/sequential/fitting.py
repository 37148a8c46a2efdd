"""The step ``fit``: sequential simulation-based inference, then a least-squares polish."""

import time

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import MuslinError
from ...core.parameters import ParameterSpace
from ...core.rollout import Trajectory
from ...core.series import PointSeries
from ...core.store import storage_errors
from ...core.study import SimulationPool, Study, Task
from ..cloud_noise import Cloud, cloud_noise
from ..correlated_noise import correlated_noise
from ..discrepancy import NONE, Discrepancy
from ..noise import Noise, estimate_noise
from ..observe import Observer
from ..polish import Objective, Polished, polish_from
from ..residuals import Offsets, residual
from ..rough_curvature import seen_past_chance
from ..roughness import roughness
from .bounds import at_bounds, bound_notes
from .doubts import doubts
from .draws import ABSENT, FAILED, WHOLE, DrawStore
from .failures import failure_notes, reasons_text, region_text
from .only_one import only_one
from .proposals import Proposals
from .result import SAMPLES, FitResult, load_fit, save_result
from .stopping import Stopping
from .takes import Takes
from .training import Learner, after_training, make_estimator

#: So many draws of the first round, and not one of them whole, end a fit at once.
HOPELESS = 20


def offsets_of(study: Study) -> Offsets:
    """Nuisance priors of a study."""
    return Offsets(study.config.nuisance.clock_offset, study.config.nuisance.constant_offset)


def fit(study: Study) -> FitResult:
    """Fit a study: continue from the draws that its store has, or return the finished result."""
    problem, config = study.problem, study.config
    noise = estimate_noise(problem, config.noise.sd, config.noise.tails)
    takes = _takes(study, noise)
    make_estimator(study, takes.correspondence)  # a wrong name or option is said now
    with only_one(study.results_path):
        return _fit(study, noise, takes)


def _fit(study: Study, noise: Noise, takes: Takes) -> FitResult:
    problem, config, space = study.problem, study.config, study.problem.space
    rounds, per_round, seed = config.estimator.rounds, config.estimator.draws, config.study.seed
    store = DrawStore(study, problem, takes.simulated, rounds * per_round)
    if store.group.attrs.get("finished"):
        return load_fit(study)
    began = time.monotonic()
    proposals = Proposals(config.estimator.proposals, len(space), seed)
    learner, stopping = Learner(study, takes), Stopping(config.estimator.stop, seed)
    with study.pool(problem) as pool:
        for k in range(rounds):
            upto = (k + 1) * per_round
            _simulate(study, pool, store, proposals.draw(per_round), k)
            theta, points, numbers = store.read(upto)
            if len(theta) < max(10, 0.1 * upto):
                raise _too_many_failed(store, space)
            study.progress(f"round {k + 1} of {rounds}: training {config.estimator.name}", 0, 0)
            posterior = learner.learn(theta, points, numbers, proposals, k)
            if stopping.after(posterior) or k + 1 == rounds:
                break
            proposals.add(posterior, *store.tried(upto))
        study.progress("polishing the best draw by least squares", 0, 0)
        before = pool.count
        best, step, found = _polished(study, pool, store, noise, takes, upto)
        truer = _truer(study, pool, best, noise)
        if truer is not noise:
            study.progress(f"learning again: the noise is not what it was taken for ({truer.source})", 0, 0)
            noise, takes = truer, _takes(study, truer)
            learner = Learner(study, takes)
            posterior = learner.learn(theta, points, numbers, proposals, k)
            best, step, found = _polished(study, pool, store, noise, takes, upto)
        simulations = problem.told_as(upto * len(takes.simulated) + pool.count - before)
    samples = posterior.sample(SAMPLES, np.random.default_rng([seed, rounds]))
    held = at_bounds(samples, best.unit, np.sqrt(np.diag(best.widened)))
    warnings = [
        *bound_notes(space, held),
        *failure_notes(space, *store.tried(upto), store.failures(), samples),
        *after_training(learner, posterior, samples),
        *found,
    ]
    about = {
        "rounds": k + 1,
        "ended": stopping.text(rounds),
        "simulations": simulations,
        "failed": len(store.failures()),
        "seconds": time.monotonic() - began,
        "warnings": warnings,
        "derivative_step": step,
        "at_bound": [n for i, n in enumerate(space.names) if any(a.index == i for a in held)],
    }
    sd = physical_sd(space, best.unit, best.widened)
    with storage_errors(study.results_path):
        save_result(store.group, study, posterior, samples, learner.log_weights, best, sd, noise, about)
    return load_fit(study)


def _takes(study: Study, noise: Noise) -> Takes:
    problem = study.problem
    recordings = [problem.recordings[r] for r in problem.fit_on]
    return Takes(Observer(recordings, noise, offsets_of(study), problem.clouds), problem.scenarios)


def _truer(study: Study, pool: SimulationPool, best: Polished, noise: Noise) -> Noise:
    """The noise as the best fit shows it: slow, or shared by neighbours; ``noise`` itself if it is neither."""
    problem, offsets = study.problem, offsets_of(study)
    values = problem.space.as_dict(problem.space.from_unit(best.unit))
    differences, clouds = [], []
    outcomes = pool.map([Task(values, name) for name in problem.fit_on])
    for recording, outcome in zip((problem.recordings[n] for n in problem.fit_on), outcomes, strict=True):
        if not isinstance(outcome, Trajectory):
            continue
        off = residual(recording, outcome.series, noise, offsets).difference
        if recording.series.correspondence:
            differences.append(off)
        elif recording.name in problem.clouds:
            clouds.append(Cloud(recording.series.points, off))
    if differences or not clouds:
        return correlated_noise(noise, differences)
    return cloud_noise(noise, clouds)


def _polished(
    study: Study, pool: SimulationPool, store: DrawStore, noise: Noise, takes: Takes, upto: int
) -> tuple[Polished, float, list[str]]:
    """The best fit, the step of its derivatives, and what makes it doubtful."""
    problem, offsets = study.problem, offsets_of(study)
    space, names = problem.space, problem.fit_on
    nearest = _draws_in_order(study, store, noise, takes, upto, NONE)[0]
    # what cannot be repeated there must not lead the fit
    discrepancy = roughness(pool, space, nearest, names).discrepancy(problem.recordings, noise, offsets)
    if discrepancy.nothing_counts(names):  # then the nearest is as good as it gets; doubts say that it is chance
        discrepancy = NONE
    objective = Objective(pool, space, names, noise, offsets, discrepancy=discrepancy)
    best = polish_from(objective, _draws_in_order(study, store, noise, takes, upto, discrepancy))
    best = seen_past_chance(objective, best)
    return best, discrepancy.step, doubts(pool, space, best.unit, noise)


def physical_sd(space: ParameterSpace, unit: FloatArray, covariance: FloatArray) -> FloatArray:
    """Standard deviations ``(D,)`` [units] from a covariance in the unit cube, to first order."""
    step = 1e-4
    slope = (space.from_unit(unit + step) - space.from_unit(unit - step)) / (2 * step)
    return np.asarray(np.abs(slope) * np.sqrt(np.diag(covariance)))


def _simulate(study: Study, pool: SimulationPool, store: DrawStore, proposal: FloatArray, round_number: int) -> None:
    """The draws of one round that the store does not have yet."""
    space, names, count = study.problem.space, store.recordings, len(proposal)
    first = round_number * count
    missing = [i for i in range(count) if store.status[first + i] == ABSENT]
    values = [space.as_dict(space.from_unit(proposal[i])) for i in missing]
    outcomes = pool.map([Task(v, r) for v in values for r in names])
    title = f"round {round_number + 1} of {study.config.estimator.rounds}: simulating"
    for done, i in enumerate(missing):
        store.write(first + i, proposal[i], {r: next(outcomes) for r in names})
        if not (store.status == WHOLE).any() and (store.status == FAILED).sum() >= HOPELESS:
            raise _too_many_failed(store, space)
        study.progress(title, count - len(missing) + done + 1, count)


def _draws_in_order(
    study: Study, store: DrawStore, noise: Noise, takes: Takes, upto: int, discrepancy: Discrepancy
) -> FloatArray:
    """Whole draws ``(N, D)`` in the unit cube, the one that comes nearest to the measurement first."""
    problem = study.problem
    theta, points, _ = store.read(upto)
    total = np.zeros(len(theta))
    for name in problem.fit_on:
        recording = problem.recordings[name]
        for k, p in enumerate(points[store.recordings.index(takes.of(name))]):
            series = PointSeries(recording.series.time, p, recording.series.unit, recording.series.correspondence)
            white = discrepancy.whitened(name, residual(recording, series, noise, offsets_of(study)).white)
            total[k] += float(white @ white)
    return np.asarray(theta[np.argsort(total, kind="stable")])


def _too_many_failed(store: DrawStore, space: ParameterSpace) -> MuslinError:
    theta, failed = store.tried(len(store.status))
    where, reasons = region_text(space, theta, failed), store.failures()
    store.forget_failures()  # what made them fail may be mended where the fingerprint of the study does not see it
    advice = "Narrow the priors in [parameters], lower [simulator] time_step or raise [study] time_limit"
    if any("in a plugin" in r for r in reasons):
        advice = "An effect, extractor or simulator of the study is at fault: mend it (muslin check NAME)"
    return MuslinError(
        f"{int(failed.sum())} of {len(failed)} draws could not be simulated: {reasons_text(reasons)}"
        + (f"; {where}" if where else "")
        + f". {advice}, then fit again"
    )
