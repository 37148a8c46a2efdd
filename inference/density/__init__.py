"""Conditional densities and how they are trained."""
