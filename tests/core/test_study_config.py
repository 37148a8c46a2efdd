import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from muslin.core.errors import InputError, MissingFileError, MuslinError
from muslin.core.measurement import Measurement, Recording
from muslin.core.registry import REGISTRY
from muslin.core.scenarios import preset
from muslin.core.series import PointSeries
from muslin.core.study import build_problem, parse_config, read_config, write_config
from muslin.core.testing.reference import ReferenceSimulator


@pytest.fixture(autouse=True)
def reference_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(REGISTRY._objects, ("simulator", "reference"), ReferenceSimulator)


def table(**changes: Any) -> dict[str, Any]:
    base: dict[str, Any] = {
        "study": {"measurement": "m.zarr"},
        "scenario": {"name": "fling", "vertices": [3, 3]},
        "simulator": {"name": "reference"},
    }
    for place, value in changes.items():
        head, _, tail = place.partition("__")
        if tail:
            base.setdefault(head, {})[tail] = value
        else:
            base[head] = value
    return base


def measurement(points: int = 9, unit: str = "m") -> Measurement:
    body = preset("fling").body(vertices=[3, 3])
    axes = 2 if unit == "px" else 3
    seen = np.tile((body.vertices + np.array([0, 0, 1.0]))[:points, :axes], (4, 1, 1))
    series = PointSeries(np.linspace(0, 0.1, 4), seen, unit)  # type: ignore[arg-type]
    return Measurement((Recording("a", series), Recording("b", series)))


def complaint(**changes: Any) -> str:
    with pytest.raises(MuslinError) as caught:
        build_problem(parse_config(table(**changes), "study.toml"), measurement())
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_a_plain_study_can_be_built() -> None:
    problem = build_problem(parse_config(table(), "s"), measurement())
    assert problem.fit_on == ("a", "b")
    assert problem.space.names == ("stretch_stiffness", "bending_rigidity")


def test_unknown_keys_name_the_nearest() -> None:
    assert "Did you mean 'vertices'" in complaint(scenario__vertexes=[3, 3])
    assert "Did you mean 'simulator'" in complaint(simulater={"name": "x"})
    assert "Did you mean 'low'" in complaint(parameters={"friction": {"lo": 0.1, "high": 1.0}})


def test_values_of_the_wrong_kind() -> None:
    assert "[study.measurement] is missing" in complaint(study={})
    assert "[estimator.draws]" in complaint(estimator={"name": "x", "draws": 1})
    assert "[noise.sd]" in complaint(noise={"sd": -1.0})
    for tails in (0.5, -3.0, 1e200, float("inf"), float("nan"), "wide"):
        assert "[noise.tails]" in complaint(noise={"tails": tails})


def test_obstacles_that_are_none() -> None:
    rod = {"kind": "cylinder", "center": [0, 2], "axis": [0, 1, 0], "radius": 0.1, "length": 0.3}
    assert "Did you mean 'cylinder'" in complaint(scenario__obstacles=[rod | {"kind": "cylnder"}])
    assert "kind is missing. Kinds: table, cylinder, mesh" in complaint(scenario__obstacles=[{"height": 0.0}])
    assert "must be a list" in complaint(scenario__obstacles={"kind": "table", "height": 0.0})
    assert "cylinder.center] has too few numbers; got [0, 2]" in complaint(scenario__obstacles=[rod])


def test_recordings() -> None:
    both = complaint(study__fit_on=["a"], study__hold_out=["a"])
    assert "recording a is both fitted on and held out" in both
    assert "no recording 'c'" in complaint(study__hold_out=["c"])
    assert "nothing is left to fit on" in complaint(study__hold_out=["a", "b"])


def test_fitting_on_nothing_is_not_fitting_on_everything() -> None:
    told = complaint(study__fit_on=[])
    assert "[study.fit_on] names no recording; leave it out to fit on every one that is not held out" in told


def test_a_material_in_another_unit() -> None:
    told = complaint(material={"areal_density": 150.0})
    assert "[material.areal_density]: areal_density is in kg/m2 and must lie between 0 and 20, but is 150" in told
    assert told.endswith("150 g/m2 are 0.15")
    assert "20, but is 50" in complaint(parameters={"areal_density": {"low": 0.05, "high": 50.0}})
    rope = {"scenario": {"name": "hang", "size": [0.4], "vertices": [9]}, "parameters": {}}
    assert "linear_density is in kg/m" in complaint(material={"linear_density": 50.0}, **rope)
    assert "diameter is in m " in complaint(material={"diameter": 8.0}, **rope)
    beam = {"scenario": {"name": "beam", "markers": list(range(9))}, "parameters": {}}
    assert "density is in kg/m3 and must lie between 3 and 30000, but is 1.07" in complaint(
        material={"density": 1.07}, **beam
    )


def test_units_and_bounds_of_parameters() -> None:
    wrong = complaint(parameters={"stretch_stiffness": {"low": 1.0, "high": 2.0, "unit": "Pa"}})
    assert "unit is 'Pa', but stretch_stiffness is in 'N/m'" in wrong
    assert "Did you mean 'friction'" in complaint(parameters={"fricton": {"low": 0.0, "high": 1.0}})
    assert "low must be below high" in complaint(parameters={"friction": {"low": 1.0, "high": 0.0}})
    assert "has no 'youngs_modulus'" in complaint(material={"youngs_modulus": 1e5})


def test_effects() -> None:
    assert "Did you mean 'wind'" in complaint(effects={"wnd": {}})
    assert "[effects.wind] has no 'speed'" in complaint(effects={"wind": {"speed": 1.0}})
    config = parse_config(table(effects={"air-drag": {"drag_coefficient": 1.2}}), "s")
    problem = build_problem(config, measurement())
    assert problem.fixed == {"air-drag.drag_coefficient": 1.2}
    assert problem.space.names[-1] == "air-drag.lift_coefficient"
    assert "[effects.adhesion]" in complaint(effects={"adhesion": {}}) and "no obstacle" in complaint(
        effects={"adhesion": {}}
    )


def test_coefficients_that_an_effect_cannot_have() -> None:
    """Said before anything is simulated; what the effect may be of either sign of stays."""
    fixed = complaint(effects={"grasp-slip": {"slipperiness": -5.0}})
    assert "[effects.grasp-slip.slipperiness]: must not be below zero, but is or may be -5 1/N" in fixed
    prior = complaint(effects={"viscous-damping": {"rate": {"low": -1.0, "high": 2.0}}})
    assert "[effects.viscous-damping.rate]: must not be below zero" in prior
    rope = {"scenario": {"name": "hang", "size": [0.4], "vertices": [9]}, "parameters": {}}
    more = complaint(effects={"rope-hysteresis": {"sliding_share": 1.5, "slip_curvature": 1.0}}, **rope)
    assert "[effects.rope-hysteresis] with sliding_share = 1.5, slip_curvature = 1: " in more
    tilted = table(effects={"gravity-tilt": {"about_x": -0.01}})
    assert build_problem(parse_config(tilted, "s"), measurement()).fixed == {"gravity-tilt.about_x": -0.01}


def test_what_the_mesh_does_not_have() -> None:
    assert "takes vertex 99, but the mesh has vertices 0 to 8" in complaint(scenario__grasps=[[0, 99]])
    assert "vertex 44" in complaint(scenario__markers=[0, 1, 2, 3, 4, 5, 6, 7, 44])
    assert "has points 0 to 8, there is no 9" in complaint(scenario__points=[9])
    assert "names 2 vertices" in complaint(scenario__markers=[0, 1])


def test_plugins_and_their_options() -> None:
    assert "Did you mean 'reference'" in complaint(simulator={"name": "refernce"})
    wrong = complaint(simulator={"name": "reference", "time_stp": 0.01})
    assert "[simulator] 'reference' has no option 'time_stp'. Did you mean 'time_step'? Options: time_step" in wrong
    wrong = complaint(extractor={"name": "markers", "colour": "red"})
    assert "[extractor] 'markers' has no option 'colour'. Options: none" in wrong


def test_points_that_cannot_be_compared() -> None:
    config = parse_config(table(), "s")
    with pytest.raises(InputError, match="in pixels"):
        build_problem(config, measurement(unit="px"))
    with pytest.raises(InputError, match="5 points, the mesh 9 vertices"):
        build_problem(config, measurement(points=5))
    flat = PointSeries(np.array([0.0, 1.0]), np.ones((2, 9, 2)))
    with pytest.raises(InputError, match="comparing needs x, y and z"):
        build_problem(config, Measurement((Recording("a", flat),)))


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="muslin new"):
        read_config(tmp_path / "nix.toml")
    with pytest.raises(InputError, match="is a folder"):
        read_config(tmp_path)
    for content in (b"[study\n", b"\xff\xfe\x00"):
        (tmp_path / "s.toml").write_bytes(content)
        with pytest.raises(InputError, match="not valid TOML"):
            read_config(tmp_path / "s.toml")


def test_a_study_file_survives_writing(tmp_path: Path) -> None:
    config = parse_config(table(effects={"wind": {}}, noise={"sd": 0.003}, estimator={"name": "x", "width": 7}), "s")
    write_config(config, tmp_path / "s.toml")
    again = read_config(tmp_path / "s.toml")
    assert again == config
    assert again.estimator.options == {"width": 7}
    assert tomllib.loads((tmp_path / "s.toml").read_text())["effects"] == {"wind": {}}
    assert [p.name for p in tmp_path.iterdir()] == ["s.toml"]
    with pytest.raises(MuslinError, match="cannot write"):
        write_config(config, tmp_path / "no folder" / "s.toml")
