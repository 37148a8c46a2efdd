"""What a fit found, and how it is written and read."""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from ...core.arrays import FloatArray
from ...core.estimator import Posterior
from ...core.parameters import ParameterSpace
from ...core.store import damage_errors, put, read
from ...core.study import Study
from ..noise import Noise
from ..polish import Polished
from ..posterior.physical import PhysicalPosterior

#: Draws of the posterior that a result holds.
SAMPLES = 2000
#: A posterior that is so many times as wide as the best fit's ± is explained.
_WIDER = 3.0
#: What a fit leaves is told above this, in parts of what noise leaves.
_MUCH = 1.5


@dataclass(frozen=True, eq=False)
class FitResult:
    """What a fit found.

    Args:
        names, units: of the parameters.
        estimate, sd: best fit and its standard deviation ``(D,)`` [units].
        samples: posterior draws ``(S, D)`` [units].
        noise: of the measurement.
        at_bound: parameters that a bound of the prior holds back.
        warnings: sentences on what makes these numbers doubtful.
        rounds: that were run.
        ended: why no more were.
        simulations: rollouts, the polish included.
        failed: draws that could not be simulated.
        seconds: of the run that finished the fit.
        derivative_step: of one-sided differences in the unit cube that suits this model; see :mod:`..roughness`.
        left: squares that the best fit leaves, in parts of what noise leaves.
        counted: the same, as often as they count, as what is left goes together in time; see :mod:`.together`. What is
            above one counts as noise in ``sd`` and in the posterior.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    estimate: FloatArray
    sd: FloatArray
    samples: FloatArray
    noise: Noise
    at_bound: tuple[str, ...]
    warnings: tuple[str, ...]
    rounds: int
    ended: str
    simulations: int
    failed: int
    seconds: float
    derivative_step: float
    left: float = 1.0
    counted: float = 1.0

    def values(self) -> dict[str, float]:
        """The best fit by name."""
        return dict(zip(self.names, self.estimate.tolist(), strict=True))

    @property
    def apart(self) -> list[str]:
        """Parameters whose best fit lies outside the posterior, so that neither is to be trusted."""
        mean, spread = self.samples.mean(axis=0), self.samples.std(axis=0)
        rows = zip(self.names, mean, self.estimate, spread, strict=True)
        return [name for name, m, best, sd in rows if abs(m - best) > _WIDER * sd]

    def text(self) -> str:
        """A few lines for people."""
        lines = [
            f"fitted with {self.simulations} simulations in {self.seconds:.0f} s, {self.failed} failed",
            f"  {self.rounds} round{'s' * (self.rounds > 1)}: {self.ended}",
        ]
        mean, spread = self.samples.mean(axis=0), self.samples.std(axis=0)
        for k, name in enumerate(self.names):
            unit = "" if self.units[k] == "1" else f" {self.units[k]}"
            lines.append(
                f"  {name}: best fit {self.estimate[k]:.4g} ± {self.sd[k]:.2g}{unit}, "
                f"posterior {mean[k]:.4g} ± {spread[k]:.2g}{unit}"
            )
        if self.left > _MUCH:
            more = self.counted / self.left
            lasting = f", counted {_times(more)} times, as it lasts" if more > _MUCH else ""
            lines.append(
                f"  the best fit leaves {_times(self.left)} times the squares that noise leaves: ± and the posterior "
                f"take what is more for noise{lasting}; muslin compare says where it is"
            )
        lines += self._explained(mean, spread)
        size, unit = (self.noise.sd * 1e3, "mm") if self.noise.unit == "m" else (self.noise.sd, self.noise.unit)
        lines.append(f"  noise {size:.3g} {unit} a coordinate ({self.noise.source})")
        lines += [f"  warning: {w}" for w in self.warnings]
        return "\n".join(lines)

    def _explained(self, mean: FloatArray, spread: FloatArray) -> list[str]:
        """Why best fit and posterior differ where they do."""
        wide = [n for n, p, b in zip(self.names, spread, self.sd, strict=True) if p > _WIDER * b]
        apart = self.apart
        lines = []
        if wide:
            lines.append(
                f"  {', '.join(wide)}: the posterior is wider than the best fit's ±, which is how far the noise alone "
                "lets the best point move if the model is right; the posterior is what the draws have taught, other "
                "explanations included, and narrows with more of them ([estimator] rounds, draws)"
            )
        if apart:
            lines.append(
                f"  {', '.join(apart)}: the best fit lies outside the posterior; trust neither before more draws bring "
                "them together, or muslin compare says what the model lacks"
            )
        return lines


def save_result(
    group: zarr.Group,
    study: Study,
    posterior: Posterior,
    samples: FloatArray,
    log_weights: FloatArray | None,
    best: Polished,
    sd: FloatArray,
    noise: Noise,
    about: dict[str, Any],
) -> None:
    """Write everything that a finished fit has found; the mark of its end comes last.

    Args:
        group: of the fit.
        study: that was fitted.
        posterior: of the last round.
        samples: of it, in the unit cube.
        log_weights: of the whole draws that it was learned from; None where all weighed the same.
        best: best fit.
        sd: its standard deviation ``(D,)`` [units].
        noise: of the measurement.
        about: further fields of :class:`FitResult`.
    """
    space: ParameterSpace = study.problem.space
    put(group, "posterior_samples", PhysicalPosterior(posterior, space).values(samples), ["sample", "parameter"])
    put(group, "posterior_log_prob", posterior.log_prob(samples), ["sample"], "log density on the unit cube")
    put(group, "posterior_file", _file_bytes(posterior), ["byte"], "1", "the posterior, as its estimator saves it")
    if log_weights is not None:
        put(group, "log_weights", log_weights, ["whole_draw"], "1", "of the density learned under over the proposals'")
    put(group, "estimate", space.from_unit(best.unit), ["parameter"])
    put(group, "estimate_sd", sd, ["parameter"])
    put(group, "estimate_unit", best.unit, ["parameter"], "unit cube")
    put(group, "estimate_covariance", best.widened, ["parameter", "parameter_2"], "unit cube")
    group.attrs.update(
        {
            "parameters": list(space.names),
            "units": list(space.units),
            "low": [p.low for p in space],
            "high": [p.high for p in space],
            "scale": [p.scale for p in space],
            "seed": study.config.study.seed,
            "engine": study.problem.simulator.engine_version(),
            "estimator": study.config.estimator.name,
            "noise": noise.as_dict(),
            **about,
        }
    )
    group.attrs["finished"] = True


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
            noise=Noise.from_dict(a["noise"]),
            at_bound=tuple(a["at_bound"]),
            warnings=tuple(a["warnings"]),
            rounds=int(a["rounds"]),
            ended=str(a["ended"]),
            simulations=int(a["simulations"]),
            failed=int(a["failed"]),
            seconds=float(a["seconds"]),
            derivative_step=float(a["derivative_step"]),
            left=float(a.get("left", 1.0)),
            counted=float(a.get("counted", a.get("left", 1.0))),
        )


def _times(number: float) -> str:
    return f"{number:.0f}" if number >= 10.0 else f"{number:.2g}"


def _file_bytes(posterior: Posterior) -> FloatArray:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "posterior.npz"
        posterior.save(path)
        return np.frombuffer(path.read_bytes(), dtype=np.uint8)
