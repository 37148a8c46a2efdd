"""Bullet's deformable world, through its C API: cloth sheets and Neo-Hookean solids."""

from .simulator import PybulletSimulator

__all__ = ["PybulletSimulator"]
