"""Posterior estimators, one a file."""
