"""Posterior estimators, the sequential loop and criticism."""
