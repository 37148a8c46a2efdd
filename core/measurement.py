"""Measurements: one object, several recordings of it."""

from collections.abc import Iterable
from dataclasses import dataclass

from .camera import Camera
from .errors import InputError
from .motion import Motion
from .series import PointSeries


def check_name(name: str) -> None:
    """Raise :class:`InputError` unless a recording may be called so.

    The name becomes a folder of the store, whose own files and reserved names must stay free.
    """
    if not name.isprintable() or set(name) & set("/\\") or name.startswith((".", "__")):
        raise InputError(f"a recording needs a name without slashes that starts with a letter, got {name!r}")
    if not name or name == "zarr.json":
        raise InputError(f"a recording cannot be named {name!r}; give it another name")


@dataclass(frozen=True, eq=False)
class Recording:
    """One take: what was seen, and what the grippers did meanwhile.

    Args:
        name: unique within the measurement.
        series: the measured points.
        gripper: gripper poses, or None when nothing moved (a clamped object).
        motion: recordings with the same motion are repeats of each other; default the name.
        load: extra mass hung where the scenario says [kg].
        camera: that the pixels are of, or None; of points in metres it says how they would look.
    """

    name: str
    series: PointSeries
    gripper: Motion | None = None
    motion: str = ""
    load: float = 0.0
    camera: Camera | None = None

    def __post_init__(self) -> None:
        check_name(self.name)
        if not 0 <= self.load < float("inf"):
            raise InputError(f"recording {self.name!r}: load must be finite and not negative, but is {self.load:g} kg")
        if not self.motion:
            object.__setattr__(self, "motion", self.name)


@dataclass(frozen=True, eq=False)
class Measurement:
    """Recordings of one object, by name.

    Args:
        recordings: in order.
    """

    recordings: tuple[Recording, ...]

    def __post_init__(self) -> None:
        if not self.recordings:
            raise InputError("a measurement needs at least one recording")
        names = self.names
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise InputError(f"recording named twice: {', '.join(twice)}; give each take its own name")
        units = {r.series.unit for r in self.recordings}
        if len(units) > 1:
            raise InputError(f"recordings of one measurement must share a unit, but these have {sorted(units)}")

    @property
    def names(self) -> list[str]:
        return [r.name for r in self.recordings]

    @property
    def unit(self) -> str:
        return self.recordings[0].series.unit

    def __getitem__(self, name: str) -> Recording:
        for r in self.recordings:
            if r.name == name:
                return r
        raise InputError(f"no recording {name!r} in this measurement; it has {', '.join(self.names)}")


def check_comparable(recording: Recording) -> None:
    """Raise :class:`InputError` unless simulated points can be held against these: x, y and z, or a known camera's."""
    if recording.series.unit == "px" and recording.camera is not None:
        if recording.series.points.shape[2] != 2:
            raise InputError(f"recording {recording.name!r} is in pixels, but its points have three coordinates")
        return
    check_spatial(recording)


def check_spatial(recording: Recording) -> None:
    """Raise :class:`InputError` unless the points are x, y and z in metres, as simulated ones are."""
    if recording.series.unit == "px":
        known = recording.camera is not None
        raise InputError(
            f"recording {recording.name!r} is in pixels, "
            + ("but this needs points in metres" if known else "and its camera is not known; ")
            + ("" if known else "only points in metres can be compared without it; import it again with --camera FILE")
        )
    if recording.series.points.shape[2] != 3:
        raise InputError(f"recording {recording.name!r} has points (x, y) in metres; comparing needs x, y and z")


def repeats(recordings: Iterable[Recording]) -> list[tuple[Recording, Recording]]:
    """Pairs of takes of the same motion under the same load, with the same corresponding points."""
    takes = [r for r in recordings if r.series.correspondence]
    return [
        (a, b)
        for i, a in enumerate(takes)
        for b in takes[i + 1 :]
        if a.motion == b.motion
        and abs(a.load - b.load) < 1e-6
        and a.series.points.shape[1:] == b.series.points.shape[1:]
    ]
