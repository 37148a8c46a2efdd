"""The study: one file that names everything, and one store that holds every result."""

import hashlib
import tempfile
from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import zarr

from ..errors import InputError, MissingFileError, StepMissingError
from ..measurement import Measurement, Recording, repeats
from ..measurement_store import load_measurement
from ..registry import REGISTRY
from ..store import damage_errors, new_store, open_store, storage_errors
from ..threads import one_thread
from .config import ParameterTable, StudyConfig, read_config, write_config
from .pool import SimulationPool
from .problem import Problem, build_problem
from .progress import Counted, Progress, silent


class Study:
    """A study and its results.

    Steps are plugins (group ``muslin.steps``), so a study needs no torch until a step does.

    Args:
        config: checked content of the study file.
        path: where the study file is, or would be; relative paths in it start there.
        workers: worker processes; None takes one a core.
        progress: called as work goes on.

    Raises:
        InputError: results would be written over the measurement.
    """

    def __init__(
        self, config: StudyConfig, path: Path, *, workers: int | None = None, progress: Progress = silent
    ) -> None:
        self.config = config
        self.path = path
        self.workers = workers
        self.progress = progress
        results, measured = self.results_path.resolve(), self.measurement_path.resolve()
        if results == measured or results in measured.parents or measured in results.parents:
            raise InputError(
                f"{path}: results would go to {self.results_path}, and the measurement is {self.measurement_path}; "
                "give each a place of its own: name another in [study] results"
            )

    @classmethod
    def load(cls, path: str | Path, *, workers: int | None = None, progress: Progress = silent) -> "Study":
        """Read a study file."""
        return cls(read_config(Path(path)), Path(path), workers=workers, progress=progress)

    @property
    def progress(self) -> Counted:
        """What is called as work goes on; any :data:`Progress` may be put there."""
        return self._progress

    @progress.setter
    def progress(self, show: Progress) -> None:
        self._progress = Counted(show)

    def save(self) -> None:
        write_config(self.config, self.path)

    @property
    def measurement_path(self) -> Path:
        return self.path.parent / self.config.study.measurement

    @property
    def results_path(self) -> Path:
        name = self.config.study.results or f"{self.path.stem}.results.zarr"
        return self.path.parent / name

    @cached_property
    def measurement(self) -> Measurement:
        if not self.measurement_path.exists():
            raise MissingFileError(
                f"{self.path}, [study] measurement: there is no store at {self.measurement_path}; make it with muslin "
                "import, or name where it is, as seen from the study file"
            )
        return load_measurement(self.measurement_path)

    @cached_property
    def problem(self) -> Problem:
        with one_thread():
            return build_problem(self.config, self.measurement, self.path.parent)

    def pool(self, problem: Problem | None = None) -> SimulationPool:
        problem = problem or self.problem
        return SimulationPool(problem, self.workers, partial(self.progress.rollout, problem.told_as))

    def fingerprint(self, step: str = "fit") -> dict[str, Any]:
        """What the result of a step depends on: the study file, the files that it names, and what was measured.

        A fit depends on held-out recordings only where they are repeats, which tell the noise; compare
        and diagnose on all of them.
        """
        table = self.config.model_dump(mode="json")
        for key in ("results", "measurement", *(["hold_out"] if step == "fit" else [])):
            table["study"].pop(key, None)
        if step != "diagnose":
            table.pop("diagnose")
        problem = self.problem
        table["study"]["fit_on"] = list(problem.fit_on)
        names = {r.name for pair in repeats(problem.recordings.values()) for r in pair} | set(problem.fit_on)
        used = [r for n, r in problem.recordings.items() if n in names or step != "fit"]
        table["measured"] = {r.name: _digest(r) for r in used}
        for name in self.config.files:
            content = (self.path.parent / name).read_bytes()
            table.setdefault("files", {})[name] = hashlib.sha256(content).hexdigest()
        return table

    def set_aside(self) -> Path | None:
        """Move results of an earlier state of the study out of the way; nothing that was simulated is lost."""
        if not self.results_path.exists():
            return None
        number = 1
        while (old := self.results_path.with_name(f"{self.results_path.stem}.old{number}.zarr")).exists():
            number += 1
        self.results_path.rename(old)
        return old

    def results(self, mode: str = "r") -> zarr.Group:
        """The results store; made empty on the first write."""
        if mode != "r" and not self.results_path.exists():
            with new_store(self.results_path) as root:
                root.attrs["kind"] = "results"
        if not self.results_path.exists():
            raise StepMissingError(f"{self.path} has not been fitted yet; run: muslin fit {self.path}")
        root = open_store(self.results_path, mode)
        if (kind := root.attrs.get("kind")) != "results":
            raise InputError(
                f"{self.results_path} is a {kind}, not a store of results; name another in [study] results of "
                f"{self.path}"
            )
        return root

    def check_writable(self) -> None:
        """Refuse results that cannot be written now, and not when the work is done.

        Raises:
            StoreError: as the write at the end would.
        """
        with storage_errors(self.results_path), tempfile.TemporaryFile(dir=self.results_path) as trial:
            trial.write(b"0")

    def step_results(self, step: str) -> zarr.Group:
        """Results of a finished step.

        Raises:
            StepMissingError: it has not been run to its end, or not since the study or the measurement changed.
        """
        root = self.results()
        with damage_errors(self.results_path):
            group = root.get(step)
        if not isinstance(group, zarr.Group) or not group.attrs.get("finished"):
            raise StepMissingError(f"{self.path} has no result of {step!r} yet; run: muslin {step} {self.path}")
        if group.attrs.get("fingerprint") != self.fingerprint(step):
            raise StepMissingError(
                f"{self.path} or its measurement has changed since {step!r} was run; run: muslin {step} {self.path}"
            )
        return group

    def _step(self, name: str, *given: Any, **options: Any) -> Any:
        step = REGISTRY.get("step", name)  # brings its libraries, which the limit is to hold for
        with one_thread():
            return step(self, *given, **options)

    def fit(self) -> Any:
        """Fit; see the step ``fit``. Continues from the draws of an interrupted run."""
        return self._step("fit")

    def compare(self) -> Any:
        """Hold the fitted model against every recording; see the step ``compare``."""
        return self._step("compare")

    def diagnose(self) -> Any:
        """Say which effect is missing; see the step ``diagnose``."""
        return self._step("diagnose")

    def next_experiment(self, **options: Any) -> Any:
        """Propose the motion that settles what the diagnosis left open; see the step ``next``."""
        return self._step("next", **options)

    def unknown(self) -> Any:
        """Estimate the force that the model lacks, and the law that it follows; see the step ``unknown``."""
        return self._step("unknown")

    def calibrate(self, *, simulations: int = 0, predictive: int = 100) -> Any:
        """Say whether the posterior can be believed; see the step ``calibrate``."""
        return self._step("calibrate", simulations=simulations, predictive=predictive)

    def export(self, kind: str, path: str | Path, **options: Any) -> None:
        """Write the posterior for other programs; see the step ``export``."""
        self._step("export", kind, Path(path), **options)

    def add(
        self,
        effects: str | Sequence[str],
        output: str | Path | None = None,
        *,
        overwrite: bool = False,
        coefficients: Mapping[str, float | ParameterTable] | None = None,
    ) -> "Study":
        """A study of the same model with more effects, their coefficients inferred.

        Args:
            effects: name of an effect plugin, or several.
            output: the new study file; default ``STEM-with-EFFECT.toml`` beside this one, of several
                ``STEM-with-EFFECT-and-EFFECT.toml``.
            overwrite: replace a file that is there.
            coefficients: of a single effect, fixed values and priors, as the study file takes them; those not named are
                inferred under the effect's own priors.

        Raises:
            InputError: the study has one of them already, or it is named twice; the file is there; an effect is no
                candidate and has several coefficients, of which it must be told some: all of them at once are more
                than recordings tell; or coefficients are given for several effects.
        """
        names = [effects] if isinstance(effects, str) else list(effects)
        if coefficients is not None and len(names) != 1:
            raise InputError(f"coefficients are of one effect, but {len(names)} are added; add one after the other")
        config = self.config.model_copy(deep=True)
        for name in names:
            self._check_added(name, config.effects, coefficients is not None)
            config.effects[name] = dict(coefficients or {})
        path = Path(output) if output else self.path_with(names)
        if path.exists() and not overwrite:
            raise InputError(f"{path} exists already; name another file, or say overwrite=True (--force)")
        if config.study.results is not None:
            config.study.results = f"{path.stem}.results.zarr"
        if path.parent.resolve() != self.path.parent.resolve():
            config.study.measurement = str(self.measurement_path.resolve())
            config.move_files(lambda name: str((self.path.parent / name).resolve()))
        study = Study(config, path, workers=self.workers, progress=self.progress)
        study.problem  # noqa: B018  an effect that cannot act here is refused before anything is written
        study.save()
        return study

    def path_with(self, effects: Sequence[str]) -> Path:
        """The study file with ``effects`` added, where nobody names one."""
        return self.path.with_name(f"{self.path.stem}-with-{'-and-'.join(effects)}.toml")

    def _check_added(self, name: str, there: Mapping[str, Any], told: bool) -> None:
        """Refuse an effect that is among those ``there``, or of which must be ``told`` what to infer."""
        added = REGISTRY.get("effect", name)
        if not added.candidate and len(added.coefficients) > 1 and not told:
            raise InputError(
                f"{name!r} must be told which of its coefficients to infer: give them to Study.add, or add a law "
                f"that muslin unknown has found: muslin unknown {self.path} --json law.json, then "
                f"muslin add --law law.json {self.path}"
            )
        if name in self.config.effects:
            raise InputError(f"{self.path} has {name!r} already")
        if name in there:
            raise InputError(f"{name!r} is named twice; name every effect once")


def _digest(recording: Recording) -> str:
    """A hash of everything that was measured in one recording, and of what looked at it."""
    series, camera = recording.series, None if recording.camera is None else recording.camera.as_table()
    digest = hashlib.sha256(f"{recording.motion} {recording.load!r} {series.correspondence} {camera}".encode())
    digest.update(series.time.tobytes() + series.points.tobytes())
    if recording.gripper is not None:
        digest.update(recording.gripper.times.tobytes() + recording.gripper.poses.tobytes())
    return digest.hexdigest()
