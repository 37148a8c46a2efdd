"""Plugins that are real distributions on disk, found through their entry points."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from muslin.core.errors import BrokenPluginError, InputError, UnknownPluginError
from muslin.core.registry import Registry

Install = Callable[..., None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Write a distribution: modules by name, and its entry points."""
    monkeypatch.syspath_prepend(tmp_path)

    def write(name: str, entry_points: str, **modules: str) -> None:
        info = tmp_path / f"{name.replace('-', '_')}-1.2.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
        (info / "entry_points.txt").write_text(entry_points)
        for module, text in modules.items():
            (tmp_path / f"{module}.py").write_text(text)
            monkeypatch.delitem(sys.modules, module, raising=False)

    return write


def test_installed_plugins_are_found_and_loaded_when_asked(install: Install) -> None:
    install("gusts", "[muslin.effects]\ngust = gusts_one:Gust\n", gusts_one="class Gust: pass\n")
    registry = Registry()
    assert "gust" in registry.names("effect")
    assert "gusts_one" not in sys.modules
    assert registry.get("effect", "gust").__name__ == "Gust"


def test_the_first_sentence_of_its_docstring_says_what_a_plugin_is(install: Install) -> None:
    words = "A ``gust``\n    that comes, at 1.5 m/s. See :mod:`.air`.\n\n    Not more."
    text = f'class Gust:\n    """{words}"""\nclass Bare:\n    pass\n'
    install("gusts", "[muslin.effects]\ngust = gusts_two:Gust\nbare = gusts_two:Bare\n", gusts_two=text)
    rows = {row.name: row for row in Registry().inventory()}
    assert rows["gust"].about == "A gust that comes, at 1.5 m/s"
    assert rows["bare"].about == ""


def test_unknown_names_are_answered_with_the_nearest() -> None:
    with pytest.raises(UnknownPluginError, match=r"Did you mean 'air-drag'.*Installed:.*wind"):
        Registry().get("effect", "air-darg")
    with pytest.raises(InputError, match="kinds are simulator"):
        Registry().get("gadget", "x")


def test_a_broken_plugin_is_listed_and_takes_no_other_down(install: Install) -> None:
    install("wreck", "[muslin.effects]\nwreck = wreck_one:Gone\n", wreck_one="raise RuntimeError('no licence [x]')\n")
    registry = Registry()
    rows = {row.name: row for row in registry.inventory()}
    assert "no licence [x]" in rows["wreck"].error
    assert rows["wreck"].distribution == "wreck 1.2"
    assert rows["air-drag"].error == ""
    with pytest.raises(BrokenPluginError, match=r"'wreck' \(wreck_one:Gone, from wreck 1.2\).*no licence"):
        registry.get("effect", "wreck")


def test_a_missing_optional_package_comes_with_the_command_that_brings_it(install: Install) -> None:
    lack = "import importlib; raise ModuleNotFoundError('No module named torch', name='torch')\n"
    install("heavy", "[muslin.estimators]\nheavy = heavy_one:E\n", heavy_one=lack)
    with pytest.raises(BrokenPluginError, match=r"pip install 'muslin\[torch\]'"):
        Registry().get("estimator", "heavy")


HOOKS = """
from muslin.core.hooks import hookimpl

@hookimpl
def muslin_register(registry):
    registry.add("effect", "hooked", {target})
"""


def test_a_hook_module_registers(install: Install) -> None:
    install("hooky", "[muslin]\nhooky = hooky_one\n", hooky_one=HOOKS.format(target="'the plugin'"))
    registry = Registry()
    assert registry.get("effect", "hooked") == "the plugin"
    assert [r.error for r in registry.inventory() if r.name == "hooked"] == [""]


@pytest.mark.parametrize(
    "text",
    [
        "import no_such_module_at_all\n",
        HOOKS.format(target="1 / 0"),
        "from muslin.core.hooks import hookimpl\n@hookimpl\ndef muslin_register(wrong): pass\n",
        "from muslin.core.hooks import hookimpl\n@hookimpl\ndef muslin_no_such_hook(registry): pass\n",
    ],
)
def test_a_broken_hook_module_is_listed_and_kills_nothing(install: Install, text: str) -> None:
    install("bad", "[muslin]\nbad = bad_hooks\n", bad_hooks=text)
    install("good", "[muslin]\ngood = good_hooks\n", good_hooks=HOOKS.format(target="'still here'"))
    registry = Registry()
    assert registry.get("effect", "hooked") == "still here"
    assert registry.get("effect", "air-drag").name == "air-drag"
    broken = [r for r in registry.inventory() if r.error]
    assert "bad" in [r.name for r in broken]


def test_what_a_script_registers_wins() -> None:
    registry = Registry()
    registry.add("effect", "air-drag", "mine")
    assert registry.get("effect", "air-drag") == "mine"
