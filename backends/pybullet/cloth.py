"""Cloth: Bullet moves and collides the vertices, the forces inside the sheet are computed here."""

from ...core.arrays import FloatArray
from ...core.material import ClothMaterial
from ...core.scene import Scene
from .bending import bending_matrix
from .elasticity import Elasticity
from .elements import Elements, plane_stress
from .world import SoftWorld


class ClothWorld(SoftWorld):
    """A sheet of constant-strain Saint Venant-Kirchhoff triangles with linear bending.

    Bullet's own springs are off. They have one stiffness for all edges, which makes a square grid with
    alternating diagonals an isotropic sheet of Poisson ratio 1/3 with E t = 4/3 k, but only inside: free
    edges, which carry half a cell, come out twice too stiff, other cells are
    anisotropic, no other Poisson ratio exists, and vertices at the rim are as heavy as the others. Its
    bending springs have no linear bending rigidity. See :class:`SoftWorld` for what Bullet does do.
    """

    def __init__(self, scene: Scene, material: ClothMaterial, time_step: float, most_substeps: int) -> None:
        elements = Elements(scene.body, plane_stress(material.stretch_stiffness, material.poisson_ratio))
        bending = material.bending_rigidity * bending_matrix(scene.body, scene.held)
        super().__init__(scene, time_step, most_substeps, Elasticity(elements, bending), lame=None)

    def _advance(
        self, positions: FloatArray, velocities: FloatArray, push: FloatArray, pull: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        matrix = self._elasticity.strain_matrix(positions)
        velocities = self._kicked(velocities, push + self._elasticity.forces(matrix, positions), pull)
        if self._beta > 0:
            velocities = self._elasticity.damped(matrix, velocities, self.masses, self._free, self._beta * self._dt)
        return self._bullet(velocities)
