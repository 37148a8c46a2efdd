"""From pictures to a study: what is simulated is looked at as the recording was."""

from pathlib import Path

import numpy as np
import pytest
from running import Muslin

from muslin.core.errors import InputError
from muslin.core.measurement_store import load_measurement, read_found_by
from muslin.core.study import Study, build_problem, parse_config, read_config, write_config

pytest.importorskip("cv2")


@pytest.mark.slow
def test_a_rendered_take_is_found_again_in_a_simulation_of_it(tmp_path: Path, muslin: Muslin) -> None:
    frames, video, points, study = (tmp_path / n for n in ("frames", "v.zarr", "p.zarr", "s.toml"))
    for arguments in (
        ["render", "lift", "--simulator", "mujoco", "--out", frames, "--fps", "5"],
        ["import", frames, "-o", video],
        ["extract", video, "--extractor", "color-mask", "--option", "points=40", "-o", points],
        ["new", study, "--measurement", points, "--scenario", "lift", "--simulator", "mujoco"],
    ):
        done = muslin(*map(str, arguments))
        assert done.returncode == 0, done.stderr
    assert read_found_by(points) == {"name": "color-mask", "points": 40}
    loaded = Study.load(study, workers=0)
    assert (loaded.config.extractor.name, loaded.config.extractor.options) == ("color-mask", {"points": 40})
    problem = loaded.problem
    # muslin render draws the middle of the prior
    middle = problem.space.as_dict(problem.space.from_unit(np.full(len(problem.space), 0.5)))
    seen, recording = problem.simulate(middle, "frames").series, problem.recordings["frames"]
    assert (seen.unit, problem.points_of("frames")) == ("px", 40)
    # it is moved by the grippers of the scenario in both; the border of the drawn object may be a pixel off
    apart = np.linalg.norm(seen.points[:, :, None] - recording.series.points[:, None], axis=-1)
    assert apart.min(axis=2).max() < 8.0  # 40 pixels of thousands, evenly chosen
    soft = problem.space.as_dict(problem.space.from_unit(np.zeros(len(problem.space))))
    assert not np.array_equal(problem.simulate(soft, "frames").series.points, seen.points)

    config = read_config(study)
    config.estimator.rounds, config.estimator.draws = 1, 12
    done = muslin("fit", str(study))
    assert done.returncode == 2 and "[noise] sd = 1.0 (in pixels)" in done.stderr
    config.noise.sd = 2.0
    study.unlink()
    write_config(config, study)
    for step, told in (("fit", "best fit"), ("compare", "the model is adequate"), ("report", "wrote")):
        done = muslin(step, str(study), *(() if step == "report" else ("--workers", "1")))
        assert done.returncode == 0 and told in (done.stdout + done.stderr).lower(), done.stderr

    measured = load_measurement(points)
    table = {
        "study": {"measurement": "p.zarr"},
        "scenario": {"name": "lift"},
        "simulator": {"name": "mujoco"},
        "extractor": {"name": "cloud"},
    }
    other = build_problem(parse_config(table, "test"), measured)
    with pytest.raises(InputError, match="gives points in m, but recording 'frames' is in px"):
        other.simulate(middle, "frames")
