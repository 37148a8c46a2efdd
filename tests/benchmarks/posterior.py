"""Are posteriors of fits as wide as they should be? Made recordings of a flung cloth, fitted as ``muslin new`` has it.

A cloth of 0.3 m and 36 markers is flung twice and seen with 2 mm noise; materials and effects are drawn from the prior,
and the model is right. Printed by number of parameters: simulations, seconds, how wide the posterior is in parts of the
best fit's ± (the median over parameters and cases), how often its 90 % intervals hold the truth, and how far the
predictions of its draws lie from the motion itself, on a recording that was fitted and on one that was not::

    python tests/benchmarks/posterior.py --parameters 2 4 8 --cases 4
"""

import argparse
import json
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from effects_bench.scoring import wilson

from muslin.backends.mujoco import MujocoSimulator
from muslin.core.material import ClothMaterial, with_fields
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.registry import REGISTRY
from muslin.core.rollout import Trajectory, rollout
from muslin.core.scenario import Scenario
from muslin.core.scenarios import preset, smooth_path
from muslin.core.study import SimulationPool, Study, Task, parse_config, write_config

SIZE, SIDE, STEP, NOISE = 0.3, 6, 0.005, 0.002
#: Effects that the model has, by number of parameters; the material's are the others.
EFFECTS = {2: (), 4: ("air-drag",), 8: ("air-drag", "added-mass", "viscous-damping", "camera-latency")}
DAMPING = {"low": 1e-3, "high": 0.1, "scale": "log"}
#: What is fitted of the cloth beside the damping of the largest model.
STIFFNESS = {
    "stretch_stiffness": {"low": 30.0, "high": 3000.0, "scale": "log"},
    "bending_rigidity": {"low": 2e-6, "high": 5e-4, "scale": "log"},
}
DRAWS = 16


def motion(reach: float) -> Motion:
    return smooth_path([(0, 0, 0, 1), (0.3, 0.03, reach, 1.03), (0.6, 0, 0, 1)], 0.2)


def study_table(parameters: int, estimator: str) -> dict[str, Any]:
    return {
        "study": {"measurement": "recording.zarr", "hold_out": ["other"]},
        "scenario": {"name": "fling", "size": [SIZE, SIZE], "vertices": [SIDE, SIDE], "settle": 0.1},
        "simulator": {"name": "mujoco", "time_step": STEP},
        "estimator": {"name": estimator},
        "parameters": {**STIFFNESS, **({"damping_time": DAMPING} if parameters == 8 else {})},
        "effects": {name: {} for name in EFFECTS[parameters]},
    }


def measured(
    space: ParameterSpace, unit: np.ndarray, effects: tuple[str, ...], rng: np.random.Generator
) -> Measurement:
    """What is seen of the cloth with the parameters ``unit (D,)`` of the unit cube."""
    values = space.as_dict(space.from_unit(unit))
    material = with_fields(ClothMaterial(), {k: v for k, v in values.items() if "." not in k})
    made = [
        plugin(**{p.name.split(".")[1]: values[p.name] for p in plugin.parameters()})
        for plugin in (REGISTRY.get("effect", name) for name in effects)
    ]
    body, recordings = preset("fling").body((SIZE, SIZE), (SIDE, SIDE)), []
    for name, reach in (("near", 0.1), ("far", 0.2), ("other", -0.15)):
        grasps, times = (np.array([0, SIDE - 1]),), np.arange(0, 1.0, 1 / 30)
        scenario = Scenario(
            name, body, grasps, motion(reach), times, np.eye(SIDE**2), np.zeros(0, np.int64), settle=0.1
        )
        series = rollout(MujocoSimulator(STEP), scenario, material, made).series
        noisy = series.points + rng.normal(0, NOISE, series.points.shape)
        recordings.append(Recording(name, replace(series, points=noisy), motion(reach)))
    return Measurement(tuple(recordings))


def space_of(parameters: int) -> ParameterSpace:
    """What is fitted, in the order of a study."""
    tables: dict[str, dict[str, Any]] = study_table(parameters, "auto")["parameters"]
    material = tuple(Parameter(name, "1", t["low"], t["high"], t["scale"]) for name, t in tables.items())
    return ParameterSpace(
        material + tuple(p for name in EFFECTS[parameters] for p in REGISTRY.get("effect", name).parameters())
    )


def case(parameters: int, seed: int, estimator: str, folder: Path) -> dict[str, Any]:
    """Make a recording, fit it, and hold the posterior against the truth."""
    rng, space = np.random.default_rng([seed, parameters]), space_of(parameters)
    unit = 0.15 + 0.7 * rng.random(len(space))
    save_measurement(measured(space, unit, EFFECTS[parameters], rng), folder / "recording.zarr")
    write_config(parse_config(study_table(parameters, estimator), "posterior.py"), folder / "study.toml")
    study = Study.load(folder / "study.toml", workers=1)
    fit, problem = study.fit(), study.problem
    assert problem.space.names == space.names
    truth, low, high = space.from_unit(unit), *np.quantile(fit.samples, [0.05, 0.95], axis=0)
    drawn = fit.samples[rng.permutation(len(fit.samples))[:DRAWS]]
    with SimulationPool(problem, 1) as pool:
        tasks = [Task(space.as_dict(v), name) for name in ("far", "other") for v in (truth, *drawn)]
        moved = [o.series.points if isinstance(o, Trajectory) else np.full(1, np.nan) for o in pool.map(tasks)]
    scatter = [
        float(np.sqrt(3.0 * np.nanmean([np.mean((m - moved[k]) ** 2) for m in moved[k + 1 : k + 1 + DRAWS]])))
        for k in (0, 1 + DRAWS)
    ]
    return {
        "parameters": parameters,
        "seed": seed,
        "simulations": fit.simulations,
        "seconds": fit.seconds,
        "widths": (fit.samples.std(axis=0) / fit.sd).tolist(),
        "held": ((low <= truth) & (truth <= high)).tolist(),
        "scatter": scatter,
        "warnings": list(fit.warnings),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parameters", type=int, nargs="+", default=[2, 4, 8], choices=list(EFFECTS))
    parser.add_argument("--cases", type=int, default=4, help="seeds 0, 1, ...")
    parser.add_argument("--estimator", default="npe-rkhs")
    parser.add_argument("--output", type=Path, default=Path("results/posterior.json"))
    given = parser.parse_args()
    print(f"{'':>10} simulations seconds width {'90 % intervals hold':>24} {'fitted':>9} {'held out':>9}")
    rows = []
    for parameters in given.parameters:
        for seed in range(given.cases):
            with tempfile.TemporaryDirectory() as folder:
                rows.append(case(parameters, seed, given.estimator, Path(folder)))
        of = [r for r in rows if r["parameters"] == parameters]
        held = [h for r in of for h in r["held"]]
        low, high = wilson(sum(held), len(held))
        share = f"{100 * np.mean(held):.0f} % ({100 * low:.0f} to {100 * high:.0f})"
        simulations, seconds = (np.median([r[key] for r in of]) for key in ("simulations", "seconds"))
        width = np.median([w for r in of for w in r["widths"]])
        fitted, other = np.median([r["scatter"] for r in of], axis=0)
        print(
            f"{parameters:>2} unknown {simulations:>11.0f} {seconds:>7.0f} {width:>5.2g} {share:>24} "
            f"{1e3 * fitted:>6.2g} mm {1e3 * other:>6.2g} mm",
            flush=True,
        )
    given.output.write_text(json.dumps({"estimator": given.estimator, "noise": NOISE, "cases": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
