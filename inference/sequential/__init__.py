"""The step ``fit``: rounds of simulation and inference."""
