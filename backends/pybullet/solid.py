"""Solids: Bullet's Neo-Hookean tetrahedra."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.material import SolidMaterial
from ...core.obstacles import Table
from ...core.scene import Scene
from .client import MARGIN
from .elasticity import Elasticity
from .elements import Elements, volumetric
from .world import SoftWorld


class SolidWorld(SoftWorld):
    r"""A solid whose elastic forces are Bullet's stable Neo-Hookean ones.

    Bullet's constants are not Lame's: linearised at rest its stress is that of
    :math:`\mu = 3/4\,\mu_B, \lambda = \lambda_B - 5/8\,\mu_B`, so it is given
    :math:`\mu_B = 4/3\,\mu, \lambda_B = \lambda + 5/6\,\mu`.

    Bullet gives all vertices the same mass m. What a substep changed in a velocity is what the elastic force
    did, so it is scaled by m over the true mass, loads included, and the position follows. Vertices that touch
    the table keep Bullet's own answer, since there the change is the table's doing; for that while they
    weigh m against elastic forces.

    Linear tetrahedra are too stiff in bending on coarse meshes, and no constant here makes up for it: a beam of
    100 x 30 x 30 mm in 8 x 3 x 3 cells sags 0.65 times what Timoshenko's theory says, in 16 x 5 x 5 cells 0.83 times.

    Bullet's own damping is off: it is not objective, and brakes rotation of a body far from its first pose.

    References:
        Smith, de Goes and Kim, *Stable Neo-Hookean flesh simulation*, 2018, section 3.4.
    """

    def __init__(self, scene: Scene, material: SolidMaterial, time_step: float, most_substeps: int) -> None:
        lame = volumetric(material.youngs_modulus, material.poisson_ratio)
        elasticity = Elasticity(Elements(scene.body, lame), bending=None)
        for_bullet = (4.0 / 3.0 * lame[1], lame[0] + 5.0 / 6.0 * lame[1])
        super().__init__(scene, time_step, most_substeps, elasticity, for_bullet)
        self._ratio = (self._equal_share / self.masses)[:, None]
        self._ratio[~self._free] = 1.0
        heights = [o.height for o in scene.obstacles if isinstance(o, Table)]
        self._touching_below = max(heights, default=-np.inf) + 0.5 * MARGIN

    def _advance(
        self, positions: FloatArray, velocities: FloatArray, push: FloatArray, pull: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        before = self._kicked(velocities, push, pull)
        x, v = self._bullet(before)
        touching = x[:, 2] < self._touching_below
        v = np.where(touching[:, None], v, before + self._ratio * (v - before))
        if self._beta > 0:
            matrix = self._elasticity.strain_matrix(positions)
            v = self._elasticity.damped(matrix, v, self.masses, self._free & ~touching, self._beta * self._dt)
        x = np.where(touching[:, None], x, positions + self._dt * v)
        self._client.set_positions(x)
        return x, v
