"""The step ``export``: a fitted posterior for other programs, in the units of its parameters."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from ...core.errors import InputError
from ...core.store import storage_errors, write_text
from ...core.study import Study
from .files import fitted_posterior, fitted_space
from .modes import modes
from .physical import PhysicalPosterior

#: What a posterior can be exported as, and the endings that its file may have.
KINDS: Mapping[str, tuple[str, ...]] = {
    "arviz": (".nc",),
    "json": (".json",),
    "domain-randomisation": (".json", ".toml"),
}
#: Levels of the quantiles in a summary.
LEVELS = (0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975)
SAMPLES = 2000


def export(study: Study, kind: str, path: Path, *, samples: int = SAMPLES, seed: int = 0) -> None:
    """Write the posterior of a fitted study to a file.

    Args:
        study: fitted.
        kind: one of :data:`KINDS`.
        path: the file; replaced if it is there.
        samples: draws in it; a summary has none.
        seed: of the draws.

    Raises:
        InputError: an unknown kind, or a file whose ending does not fit it.
        StepMissingError: the study has not been fitted.
    """
    check_kind(kind, path)
    posterior = PhysicalPosterior(fitted_posterior(study), fitted_space(study))
    origin = {"study": study.path.stem, "estimator": study.config.estimator.name}
    if kind == "arviz":
        tree = to_arviz(posterior, samples, seed, origin)
        partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
        with storage_errors(path):
            try:
                tree.to_netcdf(str(partial))
                partial.replace(path)
            finally:
                partial.unlink(missing_ok=True)
        return
    table = {**origin, **(summary(posterior) if kind == "json" else domain_randomisation(posterior, samples, seed))}
    if path.suffix == ".toml":
        write_text(path, tomli_w.dumps(table))
    else:
        write_text(path, json.dumps(table, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def check_kind(kind: str, path: Path) -> None:
    """Refuse what :func:`export` cannot write."""
    if kind not in KINDS:
        raise InputError(f"a posterior cannot be exported as {kind!r}; it can as {', '.join(KINDS)}")
    if path.suffix not in KINDS[kind]:
        raise InputError(f"a posterior as {kind} is written to a {' or '.join(KINDS[kind])} file, not to {path.name}")


def _bounds(posterior: PhysicalPosterior) -> list[dict[str, Any]]:
    return [{"name": p.name, "unit": p.unit, "low": p.low, "high": p.high, "scale": p.scale} for p in posterior.space]


def summary(posterior: PhysicalPosterior) -> dict[str, Any]:
    """Quantiles, mean, standard deviation, covariance and modes [units] as a table of plain values."""
    mean, sd = posterior.mean(), posterior.std()
    quantiles = posterior.quantiles(np.array(LEVELS))
    covariance = posterior.covariance()
    rows = [
        {
            **bounds,
            "mean": float(mean[k]),
            "sd": float(sd[k]),
            "quantiles": {f"{level:g}": float(quantiles[q, k]) for q, level in enumerate(LEVELS)},
        }
        for k, bounds in enumerate(_bounds(posterior))
    ]
    return {
        "format": "muslin-posterior-summary-1",
        "parameters": rows,
        "covariance": covariance.tolist(),
        "correlation": (covariance / np.maximum(np.outer(sd, sd), 1e-300)).tolist(),
        "modes": [
            {"mass": m.mass, "values": posterior.space.as_dict(posterior.values(m.unit))} for m in modes(posterior.unit)
        ],
    }


def domain_randomisation(posterior: PhysicalPosterior, samples: int, seed: int) -> dict[str, Any]:
    """Equally likely parameter sets for a training loop: names, units, and one row of values [units] a draw."""
    rows = posterior.sample(samples, np.random.default_rng(seed))
    return {
        "format": "muslin-domain-randomisation-1",
        "seed": seed,
        "names": list(posterior.space.names),
        "units": list(posterior.space.units),
        "low": [p.low for p in posterior.space],
        "high": [p.high for p in posterior.space],
        "samples": rows.tolist(),
    }


def to_arviz(posterior: PhysicalPosterior, samples: int, seed: int, attributes: Mapping[str, Any]) -> Any:
    """One chain of draws [units], their log density, and as many draws of the prior, as arviz has them.

    Returns:
        ``arviz.InferenceData``; from arviz 1 on a ``DataTree``. Either has ``to_netcdf``.

    Raises:
        InputError: arviz is not installed.
    """
    try:
        import arviz
    except ImportError as error:
        raise InputError("arviz is not installed; install it with: pip install 'muslin[arviz]'") from error
    rng = np.random.default_rng(seed)
    unit = posterior.unit.sample(samples, rng)
    drawn = {"posterior": posterior.values(unit), "prior": posterior.values(rng.random(unit.shape))}
    names = posterior.space.names
    groups: dict[str, Any] = {
        group: {name: values[None, :, k] for k, name in enumerate(names)} for group, values in drawn.items()
    }
    groups["sample_stats"] = {"lp": posterior.log_prob(drawn["posterior"])[None]}
    # arviz 1 takes the groups as one table and returns a tree; earlier ones take them by name.
    tree: Any = arviz.from_dict(**groups) if int(arviz.__version__.split(".")[0]) < 1 else arviz.from_dict(groups)
    for group in drawn:
        for name, parameter in zip(names, posterior.space, strict=True):
            tree[group][name].attrs.update(
                units=parameter.unit, low=parameter.low, high=parameter.high, scale=parameter.scale
            )
        tree[group].attrs.update(attributes)
    return tree
