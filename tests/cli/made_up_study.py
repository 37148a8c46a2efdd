"""A study with a made-up results store: a swinging sheet measured in air and modelled without."""

from functools import cache
from pathlib import Path

import numpy as np
import zarr

from muslin.core.arrays import FloatArray, IntArray
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.series import PointSeries
from muslin.core.store import new_store, put
from muslin.core.study.config import parse_config
from muslin.core.study.study import Study

SIDE, NOISE = 9, 0.003
ODD = "swing <b>&\"2'"
ROLES = {"fling": "fit", "swing": "held-out", ODD: "held-out"}


@cache
def sheet(kind: str, drag: float) -> FloatArray:
    """Vertices (T, V, 3) [m] of a hanging sheet under a gripper motion: Verlet steps with edge projection."""
    n, spacing, dt = SIDE, 0.3 / (SIDE - 1), 0.008
    grid = np.arange(n * n).reshape(n, n)
    pairs = [(grid[:, :-1:2], grid[:, 1::2]), (grid[:, 1:-1:2], grid[:, 2::2]), (grid[:-1:2], grid[1::2])]
    pairs += [(grid[1:-1:2], grid[2::2]), (grid[:-1, :-1], grid[1:, 1:]), (grid[:-1, 1:], grid[1:, :-1])]
    edges = [(a.ravel(), b.ravel(), spacing * (1 if k < 4 else 2**0.5)) for k, (a, b) in enumerate(pairs)]
    x = np.stack([(grid % n) * spacing - 0.15, 0.0 * grid, 1.0 - (grid // n) * spacing], -1).reshape(-1, 3)
    x[:, 1] += 0.004 * np.sin(9 * x[:, 0]) * (1.0 - x[:, 2])
    start, before, held = x.copy(), x.copy(), np.array([0, n - 1])
    frames = []
    for k in range(212):
        t = k * dt
        if k % 3 == 0:
            frames.append(x.copy())
        rate = {"fling": 0.75, "swing": 0.9}.get(kind, 1.1)
        y = 0.11 * min(1.0, 2 * rate * t) ** 2 * np.sin(2 * np.pi * rate * t)
        z = 0.12 * np.sin(np.pi * min(t / 0.9, 1.0)) ** 2 if kind == "fling" else 0.0
        v = (x - before) / dt
        g = x.reshape(n, n, 3)
        normal = np.cross(np.gradient(g, axis=0), np.gradient(g, axis=1)).reshape(-1, 3)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
        vn = (v * normal).sum(1, keepdims=True)
        a = np.array([0, 0, -9.8]) - drag * 3.0 * np.abs(vn) * vn * normal - 0.3 * v
        before, x = x, x + np.clip(v, -6, 6) * dt + a * dt * dt
        for _ in range(10):
            x[held] = start[held] + [0, y, z]
            for i, j, rest in edges:
                d = x[j] - x[i]
                length = np.linalg.norm(d, axis=1, keepdims=True) + 1e-12
                step = 0.4 * (1 - rest / length) * d
                np.add.at(x, i, step)
                np.add.at(x, j, -step)
    return np.array(frames)


def triangles() -> IntArray:
    a = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    return np.concatenate([np.stack([a, a + 1, a + SIDE], 1), np.stack([a + 1, a + SIDE + 1, a + SIDE], 1)])


def takes(name: str) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Time (T,), measured, plain and full model (T, V, 3)."""
    kind = name if name in ("fling", "swing") else "third"
    truth, plain, full = sheet(kind, 1.2), sheet(kind, 0.0), sheet(kind, 1.1)
    noise = NOISE * np.random.default_rng(len(name)).standard_normal(truth.shape)
    measured = truth + noise
    measured[20:24, 7] = np.nan
    return np.arange(len(truth)) * 0.024, measured, plain, full


def rms(a: FloatArray, b: FloatArray, axis: int) -> FloatArray:
    return np.asarray(np.sqrt(np.nanmean(((a - b) ** 2).mean(-1), axis=axis)))


def put_fit(root: zarr.Group, drag: bool = False) -> None:
    rng = np.random.default_rng(1)
    names = ["stretch_stiffness", "bending_rigidity", "areal_density"] + drag * ["air-drag.drag_coefficient"]
    low, high = [100.0, 1e-6, 0.05, 0.0][: len(names)], [5000.0, 1e-3, 0.3, 2.5][: len(names)]
    z = rng.standard_normal((600, len(names)))
    cols = [900 * np.exp(0.2 * z[:, 0]), 2e-5 * np.exp(0.5 * z[:, 1] + 0.3 * z[:, 0]), 0.3 - 0.012 * np.abs(z[:, 2])]
    if drag:
        cols[2] = 0.16 + 0.012 * z[:, 2]
        cols.append(1.19 + 0.08 * z[:, 3] + 0.05 * z[:, 2])
    samples = np.stack(cols, 1)
    group = root.create_group("fit")
    put(group, "posterior_samples", samples, ["sample", "parameter"])
    put(group, "estimate", samples.mean(0), ["parameter"])
    put(group, "estimate_sd", samples.std(0), ["parameter"])
    group.attrs.update(
        finished=True, parameters=names, units=["N/m", "N·m", "kg/m²", "1"][: len(names)], low=low, high=high,
        scale=["log", "log", "linear", "linear"][: len(names)], seed=7, rounds=2, simulations=240, failed=3,
        warnings=["3 of 240 draws could not be simulated: 3 times 'an edge is stretched 3.2 times at 0.400 s'"],
        seconds=48.3, engine="mujoco 4.0.0", estimator="bayessim-rkhs", at_bound=[] if drag else ["areal_density"],
        noise={"sd": NOISE, "ar1": 0.1, "source": "repeats", "unit": "m", "relative_error": 0.1},
        ended="the posterior did not move further", derivative_step=0.002,
    )  # fmt: skip


def put_compare(root: zarr.Group, drag: bool = False) -> None:
    group = root.create_group("compare")
    rows = []
    for name, role in ROLES.items():
        time, measured, plain, full = takes(name)
        predicted = full if drag else plain
        error = rms(predicted, measured, 1)
        worst = rms(predicted, measured, 0)
        child = group.create_group(name)
        put(child, "time", time, ["time"], "s")
        put(child, "error", error, ["time"], "m")
        put(child, "scatter", 0.002 + 0.2 * error, ["time"], "m")
        put(child, "point_error", worst, ["point"], "m")
        for label, data, dim in [("measured", measured, "point"), ("predicted", predicted, "point"),
                                 ("vertices", predicted, "vertex")]:  # fmt: skip
            put(child, label, data, ["time", dim, "axis"], "m")
        put(child, "triangles", triangles(), ["triangle", "corner"])
        put_details(child, time, measured, predicted)
        rigid = measured[:1] + (measured[:, :1] - measured[:1, :1])
        rows.append({
            "recording": name, "role": role, "rmse": float(np.sqrt((error**2).mean())), "noise": NOISE,
            "scatter": 0.004, "baseline": float(np.sqrt(np.nanmean((rigid - measured) ** 2))),
            "default": 1.2 * float(np.sqrt((error**2).mean())), "worst_time": float(time[error.argmax()]),
            "worst_point": int(worst.argmax()), "unit": "m",
        })  # fmt: skip
    group.attrs.update(
        finished=True, p_value=0.4 if drag else 0.002, adequate=drag, rows=rows,
        text="The fitted model misses the measurement most where the sheet moves broadside.",
        where="Of the squared error above the noise, three quarters arises along the free edge.",
        replicates=400, limit=2.8, sets="", groups=[
            {"partition": "phase", "name": "fast", "note": "above 0.6 m/s", "portion": 0.4, "rmse": 0.02,
             "expected": NOISE, "scatter": 1e-17, "share": 0.9},
            {"partition": "phase", "name": "slow", "note": "", "portion": 0.6, "rmse": 0.004, "expected": NOISE,
             "scatter": 0.001, "share": None},
        ],
        signs=[{"name": f"sign <{z}>", "value": 2.0, "expected": 1.0, "z": z} for z in (300.0, 2.0, -1.0)],
    )  # fmt: skip


def put_details(group: zarr.Group, time: FloatArray, measured: FloatArray, predicted: FloatArray) -> None:
    """What the comparison keeps of a recording beyond errors."""
    draws = predicted + 0.003 * np.random.default_rng(2).standard_normal((8, 1, 1, 3))
    views = np.array([[[1.0, 0, 0], [0, 0, 1]], [[0, 1.0, 0], [0, 0, 1]]])
    wave = np.sin(np.linspace(0, 6, 12))
    for name, data, dims in [
        ("difference", measured - predicted, ["time", "point", "axis"]),
        ("draws", draws.astype(np.float32), ["draw", "time", "predicted_point", "axis"]),
        ("motion_phase", np.digitize(time, [0.2, 0.9]), ["time"]),
        ("distance_from_grasp", np.linspace(0, 0.3, SIDE * SIDE), ["predicted_point"]),
        ("mmd", 0.1 + 0.05 * np.sin(time), ["time"]), ("mmd_threshold", 0.02 + 0 * time, ["time"]),
        ("views", views, ["view", "direction", "axis"]),
        ("witness", 0.1 * np.stack([np.outer(wave, wave)] * 2), ["view", "grid_row", "grid_column"]),
        ("witness_low", np.full((2, 2), -0.3), ["view", "direction"]),
        ("witness_high", np.full((2, 2), 1.2), ["view", "direction"]), ("witness_limit", np.full(2, 0.05), ["view"]),
    ]:  # fmt: skip
        put(group, name, data, dims)
    group.attrs.update(sets_worst_frame=5, motion_phases=["held still", "slow", "fast", "free flight"])


def put_diagnose(root: zarr.Group, verdict: str = "named") -> None:
    group = root.create_group("diagnose")
    held = []
    for name, role in ROLES.items():
        time, measured, plain, full = takes(name)
        before, after = rms(plain, measured, 1), rms(full, measured, 1)
        held.append((before, after) if role == "held-out" else (before[:0], after[:0]))
        child = group.create_group(name)
        put(child, "time", time, ["time"], "s")
        put(child, "predicted_before", plain, ["time", "predicted_point", "axis"], "m")
        put(child, "vertices_before", plain, ["time", "vertex", "axis"], "m")
        put(child, "error_before", before, ["time"], "m")
        put(child, "error_after", after, ["time"], "m")
        put(child, "predicted_after", full, ["time", "point", "axis"], "m")
        put(child, "vertices_after", full, ["time", "vertex", "axis"], "m")
    b, a = (float(np.sqrt((np.concatenate(x) ** 2).mean())) for x in zip(*held, strict=True))

    def candidate(name: str, c: str, mean: float, sd: float, unit: str, explained: float | None, z: float | None,
                  ident: float) -> dict[str, object]:  # fmt: skip
        share = explained or 0.0
        return {"name": name, "coefficients": {c: {"mean": mean, "sd": sd, "unit": unit}}, "explained": explained,
                "z": z, "held_out_before": b, "held_out_after": b + min(share / 0.94, 1) * (a - b) if z else None,
                "identifiability": ident}  # fmt: skip

    effects = {"named": ["air-drag"], "tied": ["air-drag", "viscous-damping"]}.get(verdict, [])
    result = {
        "verdict": verdict, "effects": effects, "simulations": 352, "seconds": 71.0, "seed": 7,
        "candidates": [
            candidate("air-drag", "drag_coefficient", 1.19, 0.09, "1", 0.94, 21.4, 0.71),
            candidate("viscous-damping", "rate", 0.8, 0.2, "1/s", 0.52, 9.7, 0.43),
            candidate("gravity-tilt", "angle_x", 0.004, 0.01, "rad", 0.03, 0.4, 0.9),
            candidate("actuator-lag", "time_constant", 0.0, 0.03, "s", None, None, 0.0),
        ],
        "error": {"noise": NOISE, "before": b, "after": a if verdict in ("named", "tied") else None, "unit": "m"},
    }  # fmt: skip
    text = ["The sheet moves too fast in the model where it moves broadside.",
            "Adding air drag takes away 94 % of the excess."]  # fmt: skip
    group.attrs.update(finished=True, text=text, result=result)


def make_study(
    folder: Path,
    *steps: str,
    verdict: str = "named",
    hidden: bool = True,
    drag: bool = False,
    correspondence: bool = True,
) -> Study:
    """A study in ``folder`` whose store holds these steps."""
    path = folder / ("cloth-with-air-drag.toml" if drag else "cloth.toml")
    store = folder / "recording.zarr"
    if not store.exists():
        label = {"effect": "air-drag", "values": {"drag_coefficient": 1.2, "<i>": [1, 2]}} if hidden else None
        recordings = [Recording(n, PointSeries(*takes(n)[:2], correspondence=correspondence)) for n in ROLES]
        save_measurement(Measurement(tuple(recordings)), store, hidden=label)
    table = {
        "study": {"measurement": "recording.zarr", "hold_out": [n for n, r in ROLES.items() if r != "fit"], "seed": 7},
        "scenario": {"name": "swing"}, "simulator": {"name": "mujoco"},
        "effects": {"air-drag": {}} if drag else {},
    }  # fmt: skip
    study = Study(parse_config(table, "test"), path)
    study.save()
    with new_store(study.results_path, overwrite=True) as root:
        root.attrs["kind"] = "results"
        if "fit" in steps:
            put_fit(root, drag)
        if "compare" in steps:
            put_compare(root, drag)
        if "diagnose" in steps:
            put_diagnose(root, verdict)
        for step in steps:
            root[step].attrs["fingerprint"] = study.fingerprint(step)
    return study
