"""The step ``calibrate``: can the posterior of a fit be believed?"""

import time

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import InputError, MuslinError, StepMissingError
from ...core.estimator import Posterior
from ...core.rollout import Trajectory
from ...core.store import read
from ...core.study import Problem, SimulationPool, Study, Task
from ..posterior.files import fitted_posterior
from ..sequential.draws import DrawStore
from ..sequential.polishing import offsets_of, takes_of
from ..sequential.result import FitResult, load_fit
from ..sequential.span import Span
from ..sequential.takes import Takes
from ..sequential.training import make_estimator
from .held_out import held_out_ranks
from .predictive import Predictive, predictive_check
from .ranks import rank_cases
from .result import Calibration, save_calibration
from .verdict import judge

#: Posterior draws that are simulated for the predictive check.
PREDICTIVE = 100
#: Fewer predictions than this make no distribution; fewer fresh simulations make no verdict.
LEAST_PREDICTIVE, LEAST_FRESH = 10, 20
#: Numbers of fresh draws start here, so that their noise is none that the fit has seen.
_FRESH = 10_000_000


def calibrate(study: Study, simulations: int = 0, predictive: int = PREDICTIVE) -> Calibration:
    """Check the posterior of a finished fit.

    Args:
        study: fitted.
        simulations: fresh draws from the posterior, simulated and ranked in the posteriors given them; they tell of
            the neighbourhood of the measurement, and of the estimator that was trained on all draws. With 0, the
            draws of the fit are used instead, a fifth left out of the training at a time.
        predictive: posterior draws simulated on every recording for the predictive check; 0 for none.

    Raises:
        StepMissingError: the study has not been fitted, or not with this version of its simulator.
        InputError: too few of either to say anything, or fresh ones for a fit with Gaussian proposals.
        MuslinError: too few of the draws can be simulated.
    """
    if 0 < simulations < LEAST_FRESH or 0 < predictive < LEAST_PREDICTIVE or min(simulations, predictive) < 0:
        raise InputError(
            f"{simulations} fresh simulations and {predictive} predictive ones: take none, or at least {LEAST_FRESH} "
            f"and {LEAST_PREDICTIVE}"
        )
    table = study.config.estimator
    if simulations and table.rounds > 1 and table.proposals == "gaussian":
        # what the estimator gives is the posterior under its Gaussian proposal, which is not kept
        raise InputError('fresh simulations cannot be judged with [estimator] proposal = "gaussian"; leave them out')
    began = time.monotonic()
    group, fit, problem = study.step_results("fit"), load_fit(study), study.problem
    study.check_writable()
    if group.attrs.get("engine") != problem.simulator.engine_version():
        raise StepMissingError(
            f"{study.path} was fitted with {group.attrs.get('engine')}, but now there is "
            f"{problem.simulator.engine_version()}; run: muslin fit {study.path}"
        )
    takes = takes_of(study, fit.noise, max(1.0, fit.counted))
    store = DrawStore(study, problem, takes.simulated, table.rounds * table.draws)
    theta, points, numbers = store.read(fit.rounds * table.draws)
    weights = read(group, "log_weights") if "log_weights" in group else None
    span = Span(takes, points, weights)
    seen = span(takes.observe(points, numbers, study.config.study.seed))
    rng = np.random.default_rng([study.config.study.seed, 6007])
    notes = [] if fit.failed == 0 else [f"{fit.failed} draws could not be simulated and are not among the cases"]
    with study.pool(problem) as pool:
        if simulations:
            posterior = fitted_posterior(study)
            fresh, flawed = _fresh(study, pool, takes, posterior, simulations, rng)
            flawed = span(flawed)
            study.progress(f"training {table.name}", 0, 0)
            estimator = make_estimator(study, takes.correspondence)
            estimator.fit(theta, seen, log_weights=weights, seed=study.config.study.seed + fit.rounds - 1)
            cases = ((estimator.posterior([a[i] for a in flawed]), fresh[i]) for i in range(len(fresh)))
            ranks = rank_cases(cases, rng, log_tilt=posterior.log_prob)
            told = f"{len(fresh)} fresh draws from the posterior: calibration near the measurement"
            if len(fresh) < simulations:
                notes.append(f"{simulations - len(fresh)} of the fresh draws could not be simulated")
        else:
            ranks = held_out_ranks(
                lambda: make_estimator(study, takes.correspondence),
                theta,
                seen,
                weights,
                study.config.study.seed,
                progress=lambda done, total: study.progress("training without a fold", done, total),
            )
            told = f"{len(ranks.weights)} draws of the fit, left out a fifth at a time"
            if weights is not None:
                told += f", weighted by the density that they stand for (worth {ranks.effective:.0f})"
        checks = _predictive(study, pool, problem, fit, predictive, rng) if predictive else []
        count = pool.count
    verdict = judge(ranks, problem.space.names, rng)
    found = Calibration(
        verdict=verdict,
        ranks=ranks,
        cases=told,
        predictive=tuple(c for c, _ in checks),
        replicates={c.recording: values for c, values in checks},
        notes=tuple(notes),
        simulations=count,
        seconds=time.monotonic() - began,
    )
    save_calibration(study, found)
    return found


def _fresh(
    study: Study, pool: SimulationPool, takes: Takes, posterior: Posterior, count: int, rng: np.random.Generator
) -> tuple[FloatArray, list[FloatArray]]:
    """Whole fresh draws ``(N, D)`` in the unit cube, and what is seen of them."""
    space, names = study.problem.space, takes.simulated
    theta = posterior.sample(count, rng)
    tasks = [Task(space.as_dict(space.from_unit(u)), r) for u in theta for r in names]
    outcomes = []
    for k, outcome in enumerate(pool.map(tasks)):
        outcomes.append(outcome)
        study.progress("simulating draws from the posterior", k + 1, len(tasks))
    rows = [outcomes[k * len(names) : (k + 1) * len(names)] for k in range(count)]
    whole = [k for k, row in enumerate(rows) if all(isinstance(o, Trajectory) for o in row)]
    if len(whole) < LEAST_FRESH:
        raise MuslinError(
            f"{count - len(whole)} of {count} fresh draws could not be simulated, and the other {len(whole)} are too "
            f"few; say --simulations {2 * count}, or lower [simulator] time_step"
        )
    points = [
        np.stack([o.series.points for k in whole if isinstance(o := rows[k][r], Trajectory)]) for r in range(len(names))
    ]
    return theta[whole], takes.observe(points, _FRESH + np.array(whole), study.config.study.seed)


def _predictive(
    study: Study, pool: SimulationPool, problem: Problem, fit: FitResult, count: int, rng: np.random.Generator
) -> list[tuple[Predictive, FloatArray]]:
    names = [*problem.fit_on, *problem.hold_out]
    draws = fit.samples[rng.choice(len(fit.samples), count, replace=len(fit.samples) < count)]
    tasks = [Task(problem.space.as_dict(d), name) for name in names for d in draws]
    outcomes = []
    for k, outcome in enumerate(pool.map(tasks)):
        outcomes.append(outcome)
        study.progress("predicting from the posterior", k + 1, len(tasks))
    checks = []
    for k, name in enumerate(names):
        predicted = [o.series.points for o in outcomes[k * count : (k + 1) * count] if isinstance(o, Trajectory)]
        if len(predicted) < LEAST_PREDICTIVE:
            study.progress(f"{name}: only {len(predicted)} of {count} posterior draws can be simulated", 0, 0)
            continue
        role = "fit" if name in problem.fit_on else "held-out"
        recording, offsets, partly = problem.recordings[name], offsets_of(study), name in problem.clouds
        checks.append(predictive_check(recording, role, predicted, fit.noise, offsets, rng, partly))
    return checks
