"""What every posterior owes: a density on the unit cube that its samples follow, and that survives a file."""

import math
import tempfile
import time
import zipfile
from pathlib import Path

import numpy as np

from ...arrays import FloatArray
from ...estimator import Posterior
from ..checks import must

#: Processor seconds that 10 000 samples may take.
SAMPLING = 1.0


def same(a: Posterior, b: Posterior) -> bool:
    """Whether two posteriors agree to the bit, in their density and in their samples."""
    grid = np.random.default_rng(5).random((50, a.dim))
    first, second = a.sample(20, np.random.default_rng(6)), b.sample(20, np.random.default_rng(6))
    return np.array_equal(a.log_prob(grid), b.log_prob(grid)) and np.array_equal(first, second)


def check_shapes_and_support(posterior: Posterior, dim: int) -> None:
    """Samples are ``(N, D)`` inside the cube; ``log_prob`` is ``(N,)``, finite inside and -inf outside."""
    must(posterior.dim == dim, f"dim is {posterior.dim}, not {dim}")
    draws = posterior.sample(500, np.random.default_rng(0))
    must(draws.shape == (500, dim), f"sample(500) has shape {draws.shape}, not (500, {dim})")
    must(np.isfinite(draws).all(), "samples are not all finite")
    outside = int(((draws < 0) | (draws > 1)).any(axis=1).sum())
    must(outside == 0, f"{outside} of 500 samples lie outside the unit cube")
    log_p = posterior.log_prob(draws)
    must(log_p.shape == (500,), f"log_prob of 500 points has shape {log_p.shape}, not (500,)")
    must(np.isfinite(log_p).all(), "log_prob of the posterior's own samples is not finite")
    far = posterior.log_prob(np.full((1, dim), 0.5) + np.array([1.0] + [0.0] * (dim - 1)))
    must(far[0] == -np.inf, f"log_prob outside the unit cube is {far[0]:g}, not -inf")


def _weighted_points(posterior: Posterior, dim: int, count: int) -> tuple[FloatArray, FloatArray, int]:
    """Points of the cube, the posterior's density over that from which they were drawn, and how many were drawn.

    Half the points are uniform and half cluster about the posterior's samples (a widened normal, of which what lies
    outside the cube is left out), so that sharp posteriors are integrated as well as flat ones.
    """
    rng = np.random.default_rng(0)
    draws = posterior.sample(2000, rng)
    center, spread = draws.mean(axis=0), 1.5 * draws.std(axis=0) + 1e-9
    clustered = center + spread * rng.standard_normal((count // 2, dim))
    points = np.concatenate([rng.random((count // 2, dim)), clustered])
    inside = ((points >= 0) & (points <= 1)).all(axis=1)
    normal = (
        -0.5 * (((points - center) / spread) ** 2).sum(axis=1) - np.log(spread).sum() - dim / 2 * math.log(2 * np.pi)
    )
    proposal = 0.5 * inside + 0.5 * np.exp(normal)
    return points[inside], np.exp(posterior.log_prob(points[inside])) / proposal[inside], len(points)


def check_normalised(posterior: Posterior, dim: int, tolerance: float = 0.05, count: int = 100_000) -> None:
    """``exp(log_prob)`` integrates to one over the cube, by importance sampling."""
    _, weights, drawn = _weighted_points(posterior, dim, count)
    total = float(np.sum(weights)) / drawn
    must(abs(total - 1) < tolerance, f"exp(log_prob) integrates to {total:.3f} over the unit cube, not to 1")


def check_samples_follow_density(posterior: Posterior, dim: int, tolerance: float = 0.1, count: int = 100_000) -> None:
    """Samples have the mean and the standard deviation of the density, and are nowhere repeated.

    Args:
        posterior: to check.
        dim: D.
        tolerance: of both, in standard deviations of the density.
        count: points by which the density is integrated.
    """
    points, weights, _ = _weighted_points(posterior, dim, count)
    mean = np.average(points, axis=0, weights=weights)
    sd = np.sqrt(np.average((points - mean) ** 2, axis=0, weights=weights))
    draws = posterior.sample(10_000, np.random.default_rng(1))
    shift, ratio = np.abs(draws.mean(axis=0) - mean) / sd, draws.std(axis=0) / sd
    must((shift < tolerance).all(), f"samples lie {shift.round(2)} standard deviations off the mean of log_prob")
    must((np.abs(ratio - 1) < tolerance).all(), f"samples spread {ratio.round(2)} times as wide as log_prob says")
    repeated = len(draws) - len(np.unique(draws, axis=0))
    must(repeated < len(draws) // 100, f"{repeated} of {len(draws)} samples repeat others")


def check_save_and_load(posterior: Posterior) -> None:
    """A saved posterior comes back the same to the bit, under exactly the name given, and holds no pickle."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "posterior.npz"
        posterior.save(path)
        must(path.is_file(), "save wrote no file under the name that was given")
        must(path.read_bytes()[:1] != b"\x80", "the saved file is a pickle")
        if zipfile.is_zipfile(path):
            with np.load(path, allow_pickle=False) as entries:
                for name in entries:
                    try:
                        entries[name]
                    except ValueError as error:
                        raise AssertionError(f"entry {name!r} of the saved file holds a pickle") from error
        must(same(posterior, type(posterior).load(path)), "the posterior changed between save and load")


def check_sampling_speed(posterior: Posterior, limit: float = SAMPLING) -> None:
    """10 000 samples take at most ``limit`` processor seconds, once a first few were drawn."""
    rng = np.random.default_rng(0)
    posterior.sample(10, rng)
    began = time.process_time()
    posterior.sample(10_000, rng)
    taken = time.process_time() - began
    must(taken < limit, f"10 000 samples take {taken:.2f} processor seconds, more than {limit:g}")
