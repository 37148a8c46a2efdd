"""Recordings that others published, read by name: see :class:`muslin.core.dataset.Dataset`."""
