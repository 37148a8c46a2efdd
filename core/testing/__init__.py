"""Conformance kits for plugins."""
