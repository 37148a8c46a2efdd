"""The registry: plugins by kind and name, found through entry points.

Each kind has an entry-point group of its own (``muslin.simulators``, ...), whose entries are loaded
one by one, only when asked for, each in its own try: a broken plugin is listed as broken and never
takes another one down. A distribution that registers several things, or computes what it registers,
uses the group ``muslin`` instead, with a module that implements the hook of :mod:`.hooks`.
"""

import difflib
import inspect
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import pluggy

from . import hooks
from .errors import BrokenPluginError, InputError, UnknownPluginError

#: Kind of plugin -> entry-point group.
GROUPS = {
    "simulator": "muslin.simulators",
    "extractor": "muslin.extractors",
    "estimator": "muslin.estimators",
    "effect": "muslin.effects",
    "step": "muslin.steps",
    "renderer": "muslin.renderers",
    "dataset": "muslin.datasets",
}


@dataclass(frozen=True)
class PluginInfo:
    """One line of ``muslin plugins``: what is installed, by whom, what it is, and why it cannot be loaded if so."""

    kind: str
    name: str
    target: str
    distribution: str
    error: str = ""
    about: str = ""


class Registry:
    """Plugins by kind and name."""

    def __init__(self) -> None:
        self._objects: dict[tuple[str, str], Any] = {}
        self._entries: dict[tuple[str, str], EntryPoint] = {}
        self._hook_errors: list[PluginInfo] = []
        self._scanned = False

    def add(self, kind: str, name: str, plugin: Any) -> None:
        """Register ``plugin`` in this process; wins over an installed one of the same name."""
        _check_kind(kind)
        self._objects[kind, name] = plugin

    def _scan(self) -> None:
        if self._scanned:
            return
        self._scanned = True
        for kind, group in GROUPS.items():
            for entry in entry_points(group=group):
                self._entries.setdefault((kind, entry.name), entry)
        manager = pluggy.PluginManager("muslin")
        manager.add_hookspecs(hooks)
        for entry in entry_points(group="muslin"):
            try:
                manager.register(entry.load(), entry.name)
                manager.check_pending()
            except Exception as error:
                if manager.has_plugin(entry.name):
                    manager.unregister(name=entry.name)
                self._hook_errors.append(PluginInfo("hooks", entry.name, entry.value, _owner(entry), _cause(error)))
        for name, plugin in manager.list_name_plugin():
            try:
                manager.subset_hook_caller(
                    "muslin_register", [p for _, p in manager.list_name_plugin() if p is not plugin]
                )(registry=self)
            except Exception as error:
                self._hook_errors.append(PluginInfo("hooks", name, str(plugin), "", _cause(error)))

    def names(self, kind: str) -> list[str]:
        """Names of every registered plugin of a kind, sorted; none of them is loaded for this."""
        _check_kind(kind)
        self._scan()
        return sorted({n for k, n in [*self._objects, *self._entries] if k == kind})

    def get(self, kind: str, name: str) -> Any:
        """The plugin object.

        Raises:
            UnknownPluginError: names the nearest and what is installed.
            BrokenPluginError: names the plugin, the distribution it came from, and the cause.
        """
        _check_kind(kind)
        self._scan()
        if (kind, name) in self._objects:
            return self._objects[kind, name]
        entry = self._entries.get((kind, name))
        if entry is None:
            raise UnknownPluginError(_unknown(kind, name, self.names(kind)))
        try:
            plugin = entry.load()
        except Exception as error:
            raise BrokenPluginError(
                f"{kind} {name!r} ({entry.value}, from {_owner(entry)}) is installed but could not be loaded: "
                f"{_cause(error)}{_advice(error)}"
            ) from error
        self._objects[kind, name] = plugin
        return plugin

    def inventory(self) -> list[PluginInfo]:
        """Every plugin, loaded on trial; the broken ones with their cause."""
        rows = []
        for kind in GROUPS:
            for name in self.names(kind):
                entry = self._entries.get((kind, name))
                target = entry.value if entry else f"{self._objects[kind, name]!r}"
                owner = _owner(entry) if entry else "this process"
                error = about = ""
                try:
                    about = _about(self.get(kind, name))
                except BrokenPluginError as broken:
                    error = _cause(broken.__cause__ or broken) + _advice(broken.__cause__)
                rows.append(PluginInfo(kind, name, target, owner, error, about))
        return rows + self._hook_errors


def _check_kind(kind: str) -> None:
    if kind not in GROUPS:
        raise InputError(f"there are no plugins of kind {kind!r}; kinds are {', '.join(GROUPS)}")


def _owner(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unknown distribution"


def _about(plugin: Any) -> str:
    """The first sentence of its docstring."""
    first = " ".join((inspect.getdoc(plugin) or "").split("\n\n")[0].split())
    return re.split(r"(?<=\.) ", first)[0].replace("``", "").rstrip(".")


def _cause(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


#: Optional packages -> the extra that brings them.
_EXTRAS = {
    "mujoco": "mujoco",
    "pybullet": "pybullet",
    "torch": "torch",
    "scipy": "torch",
    "filelock": "torch",
    "matplotlib": "report",
    "jinja2": "report",
    "ezc3d": "mocap",
    "xarray": "xarray",
    "trimesh": "mesh",
    "meshio": "mesh",
    "cv2": "perception",
    "safetensors": "perception",
    "monai": "heatmap",
    "kornia": "heatmap",
    "av": "perception",
    "pyarrow": "robotics",
    "rosbags": "robotics",
}


def _advice(error: BaseException | None) -> str:
    extra = _EXTRAS.get((getattr(error, "name", None) or "").split(".")[0])
    return f"; install it with: pip install 'muslin[{extra}]'" if extra else ""


def nearest(name: str, known: list[str]) -> str:
    """``' Did you mean ...?'`` if a known name is near, else nothing."""
    close = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    return f" Did you mean {close[0]!r}?" if close else ""


def check_options(kind: str, name: str, plugin: Any, options: Mapping[str, Any]) -> None:
    """Refuse options that a plugin does not take, or lacks.

    Args:
        kind, name: of the plugin, as a study file has them.
        plugin: what makes it.
        options: by name.

    Raises:
        InputError: names the nearest option and all that there are.
    """
    parameters = inspect.signature(plugin).parameters.values()
    known = [p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    takes = f"Options: {', '.join(known) or 'none'}"
    open_ended = any(p.kind == p.VAR_KEYWORD for p in parameters)
    for option in options:
        if option not in known and not open_ended:
            raise InputError(f"[{kind}] {name!r} has no option {option!r}.{nearest(option, known)} {takes}")
    try:
        inspect.signature(plugin).bind(**options)
    except TypeError as error:
        raise InputError(f"[{kind}] {name!r} does not take these options: {error}. {takes}") from error


def _unknown(kind: str, name: str, known: list[str]) -> str:
    return f"there is no {kind} {name!r}.{nearest(name, known)} Installed: {', '.join(known) or 'none'}"


#: The registry of this process.
REGISTRY = Registry()


def register(kind: str, name: str, plugin: Any) -> None:
    """Register a plugin in this process, for scripts and notebooks; see :class:`Registry`."""
    REGISTRY.add(kind, name, plugin)
