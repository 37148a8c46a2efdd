"""The step ``fit``: sequential simulation-based inference, then a least-squares polish."""

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.errors import InputError, MuslinError
from ...core.estimator import Posterior, PosteriorEstimator
from ...core.measurement import Recording
from ...core.parameters import ParameterSpace
from ...core.registry import REGISTRY
from ...core.series import PointSeries
from ...core.store import damage_errors, put, read, storage_errors
from ...core.study import Study, Task
from ..noise import Noise, estimate_noise
from ..observe import Observer
from ..polish import Objective, polish
from ..residuals import Offsets, residual
from .doubts import doubts
from .draws import ABSENT, FAILED, WHOLE, DrawStore
from .failures import failure_notes, reasons_text, region_text
from .only_one import only_one
from .proposals import log_weights, propose

#: So many draws of the first round, and not one of them whole, end a fit at once.
HOPELESS = 20
#: Posterior mass within 2 % of a bound above which the prior box looks too small.
AT_BOUND = 0.3
SAMPLES = 2000


@dataclass(frozen=True, eq=False)
class FitResult:
    """What a fit found.

    Args:
        names, units: of the parameters.
        estimate, sd: best fit and its standard deviation ``(D,)`` [units].
        samples: posterior draws ``(S, D)`` [units].
        noise: of the measurement.
        at_bound: parameters whose posterior is piled on a bound of the prior.
        warnings: sentences on what makes these numbers doubtful.
        simulations: rollouts, the polish included.
        failed: draws that could not be simulated.
        seconds: of the run that finished the fit.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    estimate: FloatArray
    sd: FloatArray
    samples: FloatArray
    noise: Noise
    at_bound: tuple[str, ...]
    warnings: tuple[str, ...]
    simulations: int
    failed: int
    seconds: float

    def values(self) -> dict[str, float]:
        """The best fit by name."""
        return dict(zip(self.names, self.estimate.tolist(), strict=True))

    def text(self) -> str:
        """A few lines for people."""
        lines = [f"fitted with {self.simulations} simulations in {self.seconds:.0f} s, {self.failed} failed"]
        mean, spread = self.samples.mean(axis=0), self.samples.std(axis=0)
        for k, name in enumerate(self.names):
            unit = "" if self.units[k] == "1" else f" {self.units[k]}"
            lines.append(
                f"  {name}: best fit {self.estimate[k]:.4g} ± {self.sd[k]:.2g}{unit}, "
                f"posterior {mean[k]:.4g} ± {spread[k]:.2g}{unit}"
            )
        lines.append(f"  noise {self.noise.sd * 1e3:.3g} mm a coordinate ({self.noise.source})")
        for name in self.at_bound:
            lines.append(
                f"  warning: {name} lies on a bound of its prior: the prior is too narrow, or an effect is missing"
            )
        lines += [f"  warning: {w}" for w in self.warnings]
        return "\n".join(lines)


def offsets_of(study: Study) -> Offsets:
    """Nuisance priors of a study."""
    return Offsets(study.config.nuisance.clock_offset, study.config.nuisance.constant_offset)


def fit(study: Study) -> FitResult:
    """Fit a study: continue from the draws that its store has, or return the finished result."""
    problem, config = study.problem, study.config
    noise = estimate_noise(problem, config.noise.sd)
    _estimator(study, [problem.recordings[r] for r in problem.fit_on])  # a wrong name or option is said now
    with only_one(study.results_path):
        return _fit(study, noise)


def _fit(study: Study, noise: Noise) -> FitResult:
    problem, config = study.problem, study.config
    rounds, per_round = config.estimator.rounds, config.estimator.draws
    store = DrawStore(study, problem, rounds * per_round)
    if store.group.attrs.get("finished"):
        return load_fit(study)
    began = time.monotonic()
    observer = Observer([problem.recordings[r] for r in problem.fit_on], noise, offsets_of(study))
    density: list[Posterior] = []
    with study.pool(problem) as pool:
        for k in range(rounds):
            proposal = propose(density, per_round, len(problem.space), np.random.default_rng([config.study.seed, k]))
            first = k * per_round
            missing = [i for i in range(per_round) if store.status[first + i] == ABSENT]
            tasks = [
                Task(problem.space.as_dict(problem.space.from_unit(proposal[i])), r)
                for i in missing
                for r in problem.fit_on
            ]
            outcomes = pool.map(tasks)
            for done, i in enumerate(missing):
                store.write(first + i, proposal[i], {r: next(outcomes) for r in problem.fit_on})
                if not (store.status == WHOLE).any() and (store.status == FAILED).sum() >= HOPELESS:
                    raise _too_many_failed(store, problem.space)
                study.progress(f"round {k + 1} of {rounds}: simulating", per_round - len(missing) + done + 1, per_round)
            theta, points, numbers = store.read(first + per_round)
            if len(theta) < max(10, 0.1 * (first + per_round)):
                raise _too_many_failed(store, problem.space)
            study.progress(f"round {k + 1} of {rounds}: training {config.estimator.name}", 0, 0)
            density.append(_train(study, observer, theta, points, numbers, density, k))
        study.progress("polishing the best draw by least squares", 0, 0)
        units = problem.space
        objective = Objective(pool, units, problem.fit_on, noise, offsets_of(study))
        before = pool.count
        best = polish(objective, _best_draw(study, store, noise))
        warnings = doubts(pool, units, best.unit, problem.fit_on[0], noise)
        simulations = rounds * per_round * len(problem.fit_on) + pool.count - before
    samples = density[-1].sample(SAMPLES, np.random.default_rng([config.study.seed, rounds]))
    warnings = [*failure_notes(units, *store.tried(), store.failures(), samples), *warnings]
    estimate = units.from_unit(best.unit)
    # what the model leaves unexplained makes the estimate that much less certain
    sd = physical_sd(units, best.unit, best.covariance) * np.sqrt(max(1.0, best.rss / best.count))
    near = ((samples < 0.02) | (samples > 0.98)).mean(axis=0) > AT_BOUND
    near |= (best.unit < 0.01) | (best.unit > 0.99)
    with storage_errors(study.results_path):
        group = store.group
        put(group, "posterior_samples", units.from_unit(samples), ["sample", "parameter"])
        put(group, "posterior_log_prob", density[-1].log_prob(samples), ["sample"], "log density on the unit cube")
        put(
            group, "posterior_file", _file_bytes(density[-1]), ["byte"], "1", "the posterior, as its estimator saves it"
        )
        put(group, "estimate", estimate, ["parameter"])
        put(group, "estimate_sd", sd, ["parameter"])
        put(group, "estimate_unit", best.unit, ["parameter"], "unit cube")
        put(group, "estimate_covariance", best.covariance, ["parameter", "parameter_2"], "unit cube")
        group.attrs.update(
            {
                "parameters": list(units.names),
                "units": list(units.units),
                "low": [p.low for p in units],
                "high": [p.high for p in units],
                "scale": [p.scale for p in units],
                "seed": config.study.seed,
                "rounds": rounds,
                "simulations": simulations,
                "failed": len(store.failures()),
                "seconds": time.monotonic() - began,
                "engine": problem.simulator.engine_version(),
                "estimator": config.estimator.name,
                "noise": noise.as_dict(),
                "warnings": warnings,
                "at_bound": [n for n, bad in zip(units.names, near, strict=True) if bad],
            }
        )
        group.attrs["finished"] = True
    return load_fit(study)


def load_fit(study: Study) -> FitResult:
    """The result of a finished fit."""
    group = study.step_results("fit")
    with damage_errors(study.results_path):
        a: dict[str, Any] = dict(group.attrs)
        return FitResult(
            names=tuple(a["parameters"]),
            units=tuple(a["units"]),
            estimate=read(group, "estimate"),
            sd=read(group, "estimate_sd"),
            samples=read(group, "posterior_samples"),
            noise=Noise(**a["noise"]),
            at_bound=tuple(a["at_bound"]),
            warnings=tuple(a["warnings"]),
            simulations=int(a["simulations"]),
            failed=int(a["failed"]),
            seconds=float(a["seconds"]),
        )


def physical_sd(space: ParameterSpace, unit: FloatArray, covariance: FloatArray) -> FloatArray:
    """Standard deviations ``(D,)`` [units] from a covariance in the unit cube, to first order."""
    step = 1e-4
    slope = (space.from_unit(unit + step) - space.from_unit(unit - step)) / (2 * step)
    return np.asarray(np.abs(slope) * np.sqrt(np.diag(covariance)))


def _train(
    study: Study,
    observer: Observer,
    theta: FloatArray,
    points: list[FloatArray],
    numbers: IntArray,
    proposals: list[Posterior],
    round_number: int,
) -> Posterior:
    estimator = _estimator(study, observer.recordings)
    flawed = observer.observe(points, numbers, study.config.study.seed)
    weights = log_weights(theta, proposals) if proposals else None
    estimator.fit(theta, flawed, log_weights=weights, seed=study.config.study.seed + round_number)
    return estimator.posterior(observer.measured())


def _estimator(study: Study, recordings: Sequence[Recording]) -> PosteriorEstimator:
    table = study.config.estimator
    options = dict(table.options)
    if not all(r.series.correspondence for r in recordings):
        options.setdefault("correspondence", False)
    try:
        made: PosteriorEstimator = REGISTRY.get("estimator", table.name)(**options)
    except TypeError as error:
        raise InputError(f"[estimator] {table.name!r} does not take these options: {error}") from error
    return made


def _best_draw(study: Study, store: DrawStore, noise: Noise) -> FloatArray:
    problem = study.problem
    theta, points, _ = store.read(len(store.status))
    total = np.zeros(len(theta))
    for name, simulated in zip(problem.fit_on, points, strict=True):
        recording = problem.recordings[name]
        for k, p in enumerate(simulated):
            series = PointSeries(recording.series.time, p, recording.series.unit, recording.series.correspondence)
            white = residual(recording, series, noise, offsets_of(study)).white
            total[k] += float(white @ white)
    return np.asarray(theta[int(np.argmin(total))])


def _too_many_failed(store: DrawStore, space: ParameterSpace) -> MuslinError:
    theta, failed = store.tried()
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


def _file_bytes(posterior: Posterior) -> FloatArray:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "posterior.npz"
        posterior.save(path)
        return np.frombuffer(path.read_bytes(), dtype=np.uint8)
