"""What stands around the object, as MuJoCo geoms."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.obstacles import Cylinder, Obstacle, StaticMesh, Table

#: Half size of the plane that stands for a table [m]; MuJoCo's planes are infinite for contact.
_PLANE = 5.0
#: How deep below a surface that is not convex the solid beneath it reaches, at most [m].
_DEPTH = 0.02


def geoms(obstacles: tuple[Obstacle, ...], friction: float, inflation: float, touch: str) -> tuple[str, str]:
    """The ``<asset>`` and ``<worldbody>`` elements of the obstacles.

    Args:
        obstacles: in the world frame.
        friction: the object's, to be multiplied by each obstacle's.
        inflation: the radius by which the object's elements are thicker for contact than they are meant to be
            [m]; obstacles are thinner by that.
        touch: further attributes of contact.
    """
    assets, bodies = [], []
    for number, obstacle in enumerate(obstacles):
        # of two geoms in contact the one with the higher priority decides on friction and stiffness
        coefficient = max(friction * obstacle.friction, 1e-5)
        common = f'priority="1" condim="3" contype="1" conaffinity="2" friction="{coefficient:.17g} 0 0" {touch}'
        if isinstance(obstacle, Table):
            height = obstacle.height - inflation
            bodies.append(f'<geom type="plane" size="{_PLANE} {_PLANE} 0.1" pos="0 0 {height:.17g}" {common}/>')
        elif isinstance(obstacle, Cylinder):
            radius, half = obstacle.radius - inflation, obstacle.length / 2 - inflation
            a, b = obstacle.center - half * obstacle.direction, obstacle.center + half * obstacle.direction
            bodies.append(f'<geom type="cylinder" size="{radius:.17g}" fromto="{_numbers(a)} {_numbers(b)}" {common}/>')
        else:
            for piece, points in enumerate(_convex_pieces(obstacle, inflation)):
                name = f"obstacle_{number}_{piece}"
                # inertia is of no use here, and that of flat pieces would be refused
                assets.append(f'<mesh name="{name}" vertex="{_numbers(points)}" inertia="shell"/>')
                bodies.append(f'<geom type="mesh" mesh="{name}" {common}/>')
    return "\n".join(assets), "\n".join(bodies)


def _convex_pieces(mesh: StaticMesh, inflation: float) -> list[FloatArray]:
    """Corners of convex solids that together have the mesh's surface; MuJoCo collides with convex hulls.

    A convex mesh is one. Of any other every triangle becomes a wedge, down to an inner copy of the surface
    that lies as deep as the mesh is thick enough for; neighbouring wedges share a wall.
    """
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    outer = mesh.vertices + _inward(mesh, normals, inflation)
    above = (mesh.vertices @ normals.T - np.einsum("fx,fx->f", corners[:, 0], normals)).max()
    if above <= 1e-6 * np.linalg.norm(np.ptp(mesh.vertices, axis=0)):
        return [outer]
    inner = outer.copy()
    for depth in _DEPTH * 0.6 ** np.arange(10, -1, -1):
        deeper = mesh.vertices + _inward(mesh, normals, depth)
        fits = mesh.signed_distance(deeper)[0] < -0.7 * depth
        inner[fits] = deeper[fits]
    return [np.concatenate([outer[t], inner[t]]) for t in mesh.triangles]


def _inward(mesh: StaticMesh, normals: FloatArray, depth: float) -> FloatArray:
    """How vertices move ``(N, 3)`` so that all faces around them sink by ``depth`` [m], or as nearly as they can."""
    normal_matrix, right = np.zeros((len(mesh.vertices), 3, 3)), np.zeros((len(mesh.vertices), 3))
    for corner in range(3):
        at = mesh.triangles[:, corner]
        np.add.at(normal_matrix, at, normals[:, :, None] * normals[:, None, :])
        np.add.at(right, at, -depth * normals)
    move = np.einsum("nij,nj->ni", np.linalg.pinv(normal_matrix, rcond=1e-3, hermitian=True), right)
    far = np.linalg.norm(move, axis=1, keepdims=True)
    return np.asarray(move * np.minimum(1.0, 2.0 * depth / np.where(far > 0, far, 1.0)))


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{x:.17g}" for x in np.ravel(values))
