"""The hook that a plugin module in the entry-point group ``muslin`` may implement.

::

    from muslin.core.hooks import hookimpl

    @hookimpl
    def muslin_register(registry):
        registry.add("effect", "my-effect", MyEffect)
"""

from typing import TYPE_CHECKING

import pluggy

if TYPE_CHECKING:
    from .registry import Registry

hookspec = pluggy.HookspecMarker("muslin")
hookimpl = pluggy.HookimplMarker("muslin")


@hookspec
def muslin_register(registry: "Registry") -> None:
    """Add plugins with ``registry.add(kind, name, plugin)``. Called once a process, before the first look-up."""
