"""What makes a fit doubtful is said."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from buckling import buckling_study

from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.registry import REGISTRY
from muslin.core.study import SimulationPool
from muslin.inference.noise import Noise
from muslin.inference.sequential.doubts import _left_to_chance, doubts


def test_a_time_step_that_moves_a_swung_rope_by_more_than_the_noise_is_told(tmp_path: Path) -> None:
    problem = replace(buckling_study(tmp_path).problem, fit_on=("up",))
    middle = np.full(len(problem.space), 0.5)

    def said(time_step: float, noise: float) -> list[str]:
        stepped = replace(problem, simulator=REGISTRY.get("simulator", "mujoco")(time_step=time_step))
        with SimulationPool(stepped, 0) as pool:
            return doubts(pool, problem.space, middle, Noise(noise, 0.0, "test", "m", 0.01))

    (coarse,) = said(0.01, 0.001)
    told = re.search(r"half the time step moves the model by ([\d.]+) mm, ([\d.]+) times the noise", coarse)
    assert told is not None and told.group(1) == told.group(2) and 1.1 < float(told.group(1)) < 10.0
    assert not said(0.001, 0.001)
    assert not said(0.01, 0.005)


def test_a_chaotic_simulation_is_told_with_what_would_calm_it(tmp_path: Path) -> None:
    """More damping than there is, where there is any, and where it is fitted a higher bound of it."""
    problem = replace(buckling_study(tmp_path).problem, fit_on=("up",))
    own = problem.material.damping_time

    def said(damping_time: float, *inferred: Parameter) -> str:
        material = replace(problem.material, damping_time=damping_time)
        space = ParameterSpace((*problem.space, *inferred))
        damped = replace(problem, material=material, space=space)
        with SimulationPool(damped, 0) as pool:
            told = doubts(pool, space, np.full(len(space), 0.5), Noise(1e-9, 0.0, "test", "m", 0.01))
        (chaos,) = (text for text in told if "chaotic" in text)
        return chaos

    assert own < 0.005 and "set [material] damping_time = 0.005 or lower" in said(own)
    assert "set [material] damping_time higher than the 0.02 that it is or lower" in said(0.02)
    assert "raise the lower bound [parameters.damping_time] low or lower" in said(
        own, Parameter("damping_time", "s", 1e-4, 1e-2, "log")
    )


def test_what_is_found_in_pictures_is_not_calmed_by_damping(tmp_path: Path) -> None:
    problem = buckling_study(tmp_path).problem
    looking = replace(problem, extractor=SimpleNamespace(needs_images=True))  # type: ignore[arg-type]
    told = _left_to_chance(looking, {}, ["up from 0.00 s on, by up to 4.5 px"])
    assert "[extractor] finds in drawn pictures jumps" in told and "up to 4.5 px" in told and "damping" not in told
