"""The real recordings of the benchmark: how each set becomes a study."""

import re
import runpy
import shutil
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from muslin.core.dataset import DatasetNote
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.registry import REGISTRY
from muslin.core.study import Study, read_config, write_config
from muslin.core.study.choice import chosen, start_speed
from muslin.core.study.config import ParameterTable

sys.path.insert(0, str(Path(__file__).parents[1]))  # for when it is run as a script
from published import DATA, ROOT

EXAMPLES = ROOT / "examples"

#: Takes of the beam, two of each load. One is fitted, the others are held out.
BEAM_TAKES = ("gravity-b", "gravity-a", "load52-a", "load52-b", "load101-a", "load101-b")
#: How far takes of the beam may be off as a whole [m]: the hand that let it go did not hold it equally high in all.
HELD_LOWER = 0.0015


@dataclass(frozen=True)
class Case:
    """One set.

    Args:
        name: in the table.
        needs: a file or folder that must be there.
        make: makes the study in an empty folder.
        open_loop: nothing of the measurement is taken out, so absolute errors can be compared with those of others.
        picture: goes into the documentation.
    """

    name: str
    needs: Path
    make: Callable[[Path, int | None], Study]
    open_loop: bool = False
    picture: bool = False

    @property
    def slug(self) -> str:
        """The name for a file."""
        return "-".join(re.findall(r"[a-z0-9]+", self.name.lower()))


def on_pybullet(case: Case, *left_out: str) -> Case:
    """The same on the other engine, without the parameters ``left_out`` that it does not have."""

    def make(folder: Path, workers: int | None) -> Study:
        study = case.make(folder, workers)
        config = study.config.model_copy(deep=True)
        config.simulator.name = "pybullet"
        for name in left_out:
            del config.parameters[name]
        write_config(config, study.path)
        return Study.load(study.path, workers=workers)

    return replace(case, name=f"{case.name}, PyBullet", make=make, picture=False)


def takes_of(dataset: str, path: Path, takes: Sequence[str] = ()) -> list[Recording]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DatasetNote)
        return list(REGISTRY.get("dataset", dataset)(path, list(takes)))


def ball(name: str) -> Case:
    def make(folder: Path, workers: int | None) -> Study:
        for file in (f"{name}.toml", f"{name}.vtk"):
            shutil.copy(EXAMPLES / "balls" / file, folder)
        drops = takes_of("balls", EXAMPLES / "balls/drops.csv")
        save_measurement(Measurement(tuple(drops)), folder / "balls.zarr")
        return Study.load(folder / f"{name}.toml", workers=workers)

    return Case(f"ball: {name}", EXAMPLES / "balls/drops.csv", make, picture=name == "tennis")


def beam(take: str, told: str = "", offset: float = 0.0) -> Case:
    """Fitted on one take; its repeat and those of the other loads are held out.

    Args:
        take: that is fitted.
        told: of it, in the name of the case.
        offset: how far every take may be off as a whole [m].
    """

    def make(folder: Path, workers: int | None) -> Study:
        config = read_config(EXAMPLES / "beam/study.toml")
        config.study.fit_on, config.study.hold_out = [take], [other for other in BEAM_TAKES if other != take]
        config.nuisance.constant_offset = offset
        write_config(config, folder / "study.toml")
        runpy.run_path(str(EXAMPLES / "demo.py"))["import_beam"](folder)
        return Study.load(folder / "study.toml", workers=workers)

    return Case(f"beam{told}", EXAMPLES / "beam/data", make)


def cable(number: int) -> Case:
    """All 5 s of the takes that a new study chooses. The others are never used, and the error on them is told, too."""
    path = DATA / f"cable/cable{number}.npz"

    def make(folder: Path, workers: int | None) -> Study:
        takes = sorted((r for r in takes_of("deform-cable", path) if np.isfinite(start_speed(r))), key=start_speed)
        config = read_config(EXAMPLES / "cable/study.toml")
        config.study.fit_on, config.study.hold_out = chosen(takes)
        write_config(config, folder / "study.toml")
        save_measurement(Measurement(tuple(takes)), folder / config.study.measurement)
        return Study.load(folder / "study.toml", workers=workers)

    return Case(f"cable {number}", path, make, open_loop=True, picture=True)


def given(case: Case, told: str, *effects: str) -> Case:
    """The same with ``effects``, whatever a diagnosis says."""

    def make(folder: Path, workers: int | None) -> Study:
        study = case.make(folder, workers).add(effects)
        config = study.config.model_copy(deep=True)
        config.diagnose.simulations = 300
        write_config(config, study.path)
        return Study.load(study.path, workers=workers)

    return replace(case, name=f"{case.name}, {told}", make=make)


def carried_cloth(folder: Path, workers: int | None) -> Study:
    """All takes of one day, of which the study fits three and holds three out."""
    config = read_config(EXAMPLES / "carried_cloth/study.toml")
    names = sorted(file.stem for file in (DATA / "cloth_carried").glob("2021_07_05_*.npz"))
    shutil.copy(EXAMPLES / "carried_cloth/study.toml", folder)
    save_measurement(
        Measurement(tuple(takes_of("carried-cloth", DATA / "cloth_carried", names))), folder / config.study.measurement
    )
    return Study.load(folder / "study.toml", workers=workers)


def carried_in_air(folder: Path, workers: int | None) -> Study:
    """The same with what the air does to a sheet, whatever a diagnosis says, and so stiff a cloth as it then takes."""
    study = carried_cloth(folder, workers).add(["air-drag", "added-mass"])
    config = study.config.model_copy(deep=True)
    config.parameters["bending_rigidity"] = ParameterTable(low=2e-6, high=5e-3, scale="log")
    config.parameters["stretch_stiffness"] = ParameterTable(low=30.0, high=3000.0, scale="log")
    config.diagnose.simulations = 400
    write_config(config, study.path)
    return Study.load(study.path, workers=workers)


def cloud(motion: str, sheet: str) -> Case:
    """One trial of a sheet is fitted, the other held out."""

    def make(folder: Path, workers: int | None) -> Study:
        config = read_config(EXAMPLES / f"cloth_cloud/{motion}.toml")
        config.study.fit_on, config.study.hold_out = [f"{motion}_{sheet}"], [f"{motion}_{sheet}2"]
        shutil.copy(EXAMPLES / f"cloth_cloud/{motion}.obj", folder)
        takes = takes_of("cloth-cloud", DATA / "cloth_cloud", [*config.study.fit_on, *config.study.hold_out])
        save_measurement(Measurement(tuple(takes)), folder / config.study.measurement)
        write_config(config, folder / "study.toml")
        return Study.load(folder / "study.toml", workers=workers)

    return Case(f"cloud: {motion} {sheet}", DATA / "cloth_cloud", make, picture=sheet == "paper")


BEAMS = [beam("gravity-b"), beam("load52-a", ", from 52 g", HELD_LOWER)]
CABLES = [cable(number) for number in (1, 2, 3)]
SLIDING = [given(case, "bent, sliding", "rest-curvature", "rope-hysteresis") for case in CABLES]
UNEVEN = [given(case, "uneven", "uneven-rigidity") for case in SLIDING]
CARRIED = Case("carried cloth", DATA / "cloth_carried", carried_cloth)
IN_AIR = Case("carried cloth, air", DATA / "cloth_carried", carried_in_air, picture=True)
CASES = [
    *(ball(name) for name in ("whiffle", "tennis", "volleyball", "golf", "bowling")),
    *BEAMS,
    *(replace(on_pybullet(case), picture=case is BEAMS[1]) for case in BEAMS),
    *CABLES,
    *SLIDING,
    *UNEVEN,
    *(on_pybullet(case, "twist_rigidity") for case in SLIDING),
    *(CARRIED, on_pybullet(CARRIED), IN_AIR, on_pybullet(IN_AIR)),
    *(cloud(motion, sheet) for motion in ("lift", "fold") for sheet in ("tan", "paper", "navy")),
]
