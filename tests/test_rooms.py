"""The rooms and what may pass between them."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import muslin

ROOT = Path(muslin.__file__).parent
ROOMS = ("core", "backends", "perception", "inference", "plugins", "cli")
ENGINES = (
    "mujoco",
    "pybullet",
    "torch",
    "scipy",
    "cv2",
    "safetensors",
    "monai",
    "kornia",
    "trimesh",
    "matplotlib",
    "jinja2",
    "xarray",
    "ezc3d",
    "meshio",
    "av",
    "pyarrow",
    "rosbags",
)
LONGEST = 300


def modules(room: str) -> list[Path]:
    found = sorted((ROOT / room).rglob("*.py"))
    assert found, f"room {room} is empty"
    return found


def imports(path: Path) -> Iterator[tuple[str, bool]]:
    """Absolute names of what a module imports, and whether on its top level."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    top = set(map(id, tree.body))
    package = ("muslin", *path.relative_to(ROOT).parent.parts)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, id(node) in top
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            stem = ".".join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                yield f"{stem}.{alias.name}", id(node) in top


@pytest.mark.parametrize("room", ROOMS)
def test_no_room_imports_a_sibling(room: str) -> None:
    for path in modules(room):
        for name, _ in imports(path):
            parts = name.split(".")
            if parts[0] == "muslin" and len(parts) > 1 and parts[1] in ROOMS:
                assert parts[1] in ("core", room), f"{path.relative_to(ROOT)} imports {name}"
            assert parts[0] not in ROOMS, f"{path.relative_to(ROOT)} imports {name}; say muslin.{name}"


def test_backends_do_not_know_each_other() -> None:
    for path in modules("backends"):
        own = path.relative_to(ROOT / "backends").parts[0]
        for name, _ in imports(path):
            parts = name.split(".")
            if parts[:2] == ["muslin", "backends"] and len(parts) > 2:
                assert parts[2] == own, f"{path.relative_to(ROOT)} imports {name}"


def test_core_imports_no_engine_and_no_torch() -> None:
    for path in modules("core"):
        for name, top in imports(path):
            engine = name.split(".")[0]
            lazy_reader = path.name == "c3d_reader.py" and engine == "ezc3d" and not top
            assert engine not in ENGINES or lazy_reader, f"{path.relative_to(ROOT)} imports {name}"


@pytest.mark.parametrize("room", ROOMS)
def test_modules_can_be_read_in_one_sitting(room: str) -> None:
    for path in modules(room):
        length = len(path.read_text(encoding="utf-8").splitlines())
        assert length <= LONGEST, f"{path.relative_to(ROOT)} has {length} lines; one idea a file"


BLOCKED = """
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {engines!r}:
            raise ImportError(f"{{name}} is blocked")

sys.meta_path.insert(0, Blocker())
import muslin
import muslin.cli.main
import muslin.core.testing
import muslin.core.importing
muslin.cli.main.run(["plugins"])
"""


def test_muslin_imports_and_lists_plugins_where_no_engine_is_installed(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", BLOCKED.format(engines=ENGINES)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    assert "air-drag" in done.stdout


def test_every_package_is_in_the_wheel() -> None:
    import tomllib

    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    found = {
        ".".join(("muslin", *p.parent.relative_to(ROOT).parts)) for r in ROOMS for p in (ROOT / r).rglob("__init__.py")
    }
    own = {name for name in found if not (ROOT / Path(*name.split(".")[1:]) / "pyproject.toml").exists()}
    assert own | {"muslin"} == set(listed)
