"""Where a LeRobot data set keeps what."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...errors import InputError, MissingFileError
from ...optional import library

_DATA = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
_VIDEO = "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4"
#: So many episodes are read without being asked for.
_UNASKED = 1


@dataclass(frozen=True)
class Episode:
    """One episode: its number, and in v3.0 its row of the table of episodes."""

    index: int
    row: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return f"episode_{self.index:06d}"

    def begin(self, camera: str) -> float:
        """When it begins in the video file of a camera [s]."""
        return float(self.row.get(f"videos/{camera}/from_timestamp", 0.0))


class LeRobotFiles:
    """The files of a data set.

    Args:
        path: of its folder.

    Raises:
        InputError: ``meta/info.json`` is none of versions 2 or 3, or lacks what is needed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        place = path / "meta" / "info.json"
        try:
            info = json.loads(place.read_text(encoding="utf-8"))
            self.features: dict[str, dict[str, Any]] = dict(info["features"])
            self.fps = float(info["fps"])
            self._version = int(str(info["codebase_version"]).lstrip("v").split(".")[0])
            self._count = int(info["total_episodes"])
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise InputError(f"{place} is not that of a LeRobot data set: {type(error).__name__} {error}") from error
        if self._version not in (2, 3):
            raise InputError(
                f"{path} has version {info['codebase_version']}, but versions 2 and 3 can be read; convert it with the "
                "scripts of lerobot"
            )
        if not self.fps > 0:
            raise InputError(f"{place}: fps must be above 0, but is {self.fps:g}")
        self._data = str(info.get("data_path") or _DATA)
        self._video = str(info.get("video_path") or _VIDEO)
        self._chunk = int(info.get("chunks_size") or 1000)

    def episodes(self, wanted: Sequence[str]) -> list[Episode]:
        """The episodes of these numbers or names, ``all``, or the only one."""
        known = self._rows() if self._version == 3 else {k: Episode(k) for k in range(self._count)}
        span = f"{len(known)} episodes, {min(known)} to {max(known)}" if known else "no episodes"
        if not wanted and len(known) > _UNASKED:
            raise InputError(f"{self.path} has {span}; choose with --take NUMBER, once an episode, or --take all")
        if not wanted or list(wanted) == ["all"]:
            return list(known.values())
        found = []
        for text in wanted:
            number = text.removeprefix("episode_")
            if not number.isdecimal() or int(number) not in known:
                raise InputError(f"{self.path} has no episode {text!r}; it has {span}")
            found.append(known[int(number)])
        return found

    def table(self, episode: Episode, camera: str) -> dict[str, list[Any]]:
        """Columns of an episode's rows: times, vectors of numbers, and the pictures of ``camera`` if they are here."""
        path = self._file(self._data, episode, "data", "")
        parquet = library("pyarrow.parquet", "LeRobot data sets", "robotics")
        with _reading(path):
            there = parquet.read_schema(path).names
            columns = [c for c in there if c not in self.features or _numeric(self.features[c]) or c == camera]
            rows = parquet.read_table(path, columns=columns, filters=[("episode_index", "=", episode.index)])
            made: dict[str, list[Any]] = rows.to_pydict()
        if not made.get("timestamp"):
            raise InputError(f"{path} has no rows with a timestamp of episode {episode.index}")
        return made

    def video(self, episode: Episode, camera: str) -> Path:
        """The video file that an episode is in."""
        return self._file(self._video, episode, f"videos/{camera}", camera)

    def _file(self, pattern: str, episode: Episode, prefix: str, camera: str) -> Path:
        row = episode.row
        try:
            name = pattern.format(
                episode_index=episode.index,
                episode_chunk=episode.index // self._chunk,
                chunk_index=int(row.get(f"{prefix}/chunk_index", 0)),
                file_index=int(row.get(f"{prefix}/file_index", 0)),
                video_key=camera,
            )
        except (LookupError, ValueError, AttributeError) as error:
            raise InputError(f"{self.path}: meta/info.json has a path that is not known: {pattern!r}") from error
        if not (self.path / name).is_file():
            raise MissingFileError(
                f"{self.path} lacks {name}, which episode {episode.index} is in; fetch the whole set"
            )
        return self.path / name

    def _rows(self) -> dict[int, Episode]:
        files = sorted((self.path / "meta" / "episodes").rglob("*.parquet"))
        if not files:
            raise MissingFileError(f"{self.path} lacks meta/episodes, the table of its episodes; fetch the whole set")
        parquet = library("pyarrow.parquet", "LeRobot data sets", "robotics")
        known: dict[int, Episode] = {}
        for path in files:
            with _reading(path):
                names = parquet.read_schema(path).names
                # statistics of every feature are in it, too
                columns = [c for c in names if not c.startswith("stats/")]
                for row in parquet.read_table(path, columns=columns).to_pylist():
                    known[int(row["episode_index"])] = Episode(int(row["episode_index"]), row)
        return dict(sorted(known.items()))


class _reading:
    """Turns whatever Parquet raises on a damaged file into one line."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, Exception) and not isinstance(error, InputError):
            reason = (str(error) or type(error).__name__).splitlines()[0]
            raise InputError(f"{self._path} cannot be read as Parquet ({reason}); copy it again") from error


def _numeric(feature: Mapping[str, Any]) -> bool:
    return str(feature.get("dtype", "")).startswith(("float", "int"))
