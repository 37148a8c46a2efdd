"""Engines behind the Simulator interface."""
