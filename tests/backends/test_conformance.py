"""Both engines pass the kit that third parties use."""

import importlib

import pytest

from muslin.core.registry import REGISTRY
from muslin.core.testing import check_simulator


@pytest.mark.parametrize("name", ["mujoco", "pybullet"])
def test_simulator(name: str) -> None:
    pytest.importorskip(name)
    check_simulator(REGISTRY.get("simulator", name))


@pytest.mark.parametrize("name", ["mujoco", "pybullet"])
def test_loading_the_plugin_does_not_need_the_engine(name: str) -> None:
    assert importlib.import_module(f"muslin.backends.{name}").__name__.endswith(name)
