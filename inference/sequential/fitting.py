"""The step ``fit``: sequential simulation-based inference, then a least-squares polish."""

import time

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import MuslinError
from ...core.estimator import Posterior
from ...core.parameters import ParameterSpace
from ...core.store import storage_errors
from ...core.study import SimulationPool, Study, Task
from ..estimators.inputs import MIN_DRAWS
from ..noise import Noise, estimate_noise
from ..polish import MISFIT
from ..posterior.cube_gaussian import cube_gaussian
from .bounds import at_bounds, bound_notes
from .doubts import doubts
from .draws import ABSENT, FAILED, WHOLE, DrawStore
from .failures import failure_notes, reasons_text, region_text
from .only_one import only_one
from .polishing import Polishing, takes_of
from .proposals import Proposals
from .result import SAMPLES, FitResult, load_fit, save_result
from .stopping import Stopping
from .training import Learner, after_training, make_estimator

#: So many draws of the first round, and not one of them whole, end a fit at once.
HOPELESS = 20
#: Draws of a first posterior that are simulated where the best fit leaves a misfit.
GUESSES = 24


def fit(study: Study) -> FitResult:
    """Fit a study: continue from the draws that its store has, or return the finished result."""
    noise = estimate_noise(study.problem, study.config.noise.sd, study.config.noise.tails)
    takes = takes_of(study, noise)
    make_estimator(study, takes.correspondence)  # a wrong name or option is said now
    with only_one(study.results_path):
        return _fit(study, noise, takes.simulated)


def _fit(study: Study, noise: Noise, simulated: list[str]) -> FitResult:
    problem, config, space = study.problem, study.config, study.problem.space
    rounds, per_round, seed = config.estimator.rounds, config.estimator.draws, config.study.seed
    store = DrawStore(study, problem, simulated, rounds * per_round)
    if store.group.attrs.get("finished"):
        return load_fit(study)
    began = time.monotonic()
    proposals = Proposals(config.estimator.proposals, len(space), seed)
    learner, stopping = Learner(study), Stopping(config.estimator.stop, seed)
    with study.pool(problem) as pool:
        polishing = Polishing(study, pool, store, noise)
        for k in range(rounds):
            upto = (k + 1) * per_round
            _simulate(study, pool, store, proposals.draw(per_round), k)
            theta, points, numbers = store.read(upto)
            if len(theta) < 0.1 * upto or proposals.counting(theta) < MIN_DRAWS:
                raise _too_many_failed(store, space)
            study.progress(f"round {k + 1} of {rounds}: polishing the best draw by least squares", 0, 0)
            polishing.look(upto)
            if (
                k == 0 and polishing.best.left >= MISFIT
            ):  # a wrong valley, perhaps, and what all draws tell leads elsewhere
                study.progress(
                    f"training {config.estimator.name} to look elsewhere, as the best fit leaves a misfit", 0, 0
                )
                guess = learner.learn(takes_of(study, polishing.noise), [], theta, points, numbers, proposals, k)
                study.progress(f"searching from where {config.estimator.name} looks", 0, 0)
                polishing.look_from(guess.sample(GUESSES, np.random.default_rng([seed, 4049])))
            within = None
            if k == 0 < rounds - 1 and proposals.kind == "truncated":
                study.progress(f"round {k + 1} of {rounds}: looking where the posterior ends", 0, 0)
                within = polishing.narrowed(upto, np.random.default_rng([seed, 4051]))
            posterior: Posterior
            if within is not None:
                posterior = cube_gaussian(polishing.best.unit, polishing.best.widened)
            else:
                study.progress(f"round {k + 1} of {rounds}: training {config.estimator.name}", 0, 0)
                posterior = learner.learn(polishing.takes, polishing.predicted, theta, points, numbers, proposals, k)
            if stopping.after(posterior) or k + 1 == rounds:
                break
            proposals.add(posterior, *store.tried(upto), within)
        best, noise = polishing.best, polishing.noise
        study.progress("asking what chance and the time step do to the best fit", 0, 0)
        found = doubts(pool, space, best.unit, noise)
        simulations = problem.told_as(upto * len(simulated) + polishing.simulations)
    samples = posterior.sample(SAMPLES, np.random.default_rng([seed, rounds]))
    held = at_bounds(samples, best.unit, np.sqrt(np.diag(best.widened)))
    warnings = [
        *bound_notes(space, held),
        *failure_notes(space, *store.tried(upto), store.failures(), samples),
        *after_training(learner, posterior, samples),
        *proposals.at_the_rim(samples, rounds),
        *found,
    ]
    about = {
        "rounds": k + 1,
        "ended": stopping.text(rounds),
        "simulations": simulations,
        "failed": len(store.failures()),
        "seconds": time.monotonic() - began,
        "warnings": warnings,
        "derivative_step": polishing.objective.discrepancy.step,
        "left": best.left,
        "counted": best.excess,
        "at_bound": [n for i, n in enumerate(space.names) if any(a.index == i for a in held)],
    }
    sd = physical_sd(space, best.unit, best.widened)
    with storage_errors(study.results_path):
        save_result(store.group, study, posterior, samples, learner.log_weights, best, sd, noise, about)
    return load_fit(study)


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


def _too_many_failed(store: DrawStore, space: ParameterSpace) -> MuslinError:
    theta, failed = store.tried(len(store.status))
    where, reasons = region_text(space, theta, failed), store.failures()
    store.forget_failures()  # what made them fail may be mended where the fingerprint of the study does not see it
    advice = "Narrow the priors in [parameters], lower [simulator] time_step or raise [study] time_limit"
    if failed.mean() < 0.5:
        advice = f"At least {MIN_DRAWS} draws that count are needed in every round: raise [estimator] draws"
    if any("in a plugin" in r for r in reasons):
        advice = "An effect, extractor or simulator of the study is at fault: mend it (muslin check NAME)"
    return MuslinError(
        f"{int(failed.sum())} of {len(failed)} draws could not be simulated: {reasons_text(reasons)}"
        + (f"; {where}" if where else "")
        + f". {advice}, then fit again"
    )
