"""MuJoCo flex: cloth as a shell, solids as quadratic or tetrahedral finite elements."""

from .simulator import MujocoSimulator

__all__ = ["MujocoSimulator"]
