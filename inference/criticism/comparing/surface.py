"""Places all over an object, as weights of its vertices: where a point of a cloud can have come from."""

import numpy as np
from scipy import sparse

from ....core.scenario import Scenario

#: Places on the object, at most.
_MOST = 20_000
#: Parts into which an edge is cut, at most.
_FINEST = 16


def surface_lattice(scenario: Scenario) -> sparse.csr_array | None:
    """Weights ``(L, V)`` of places spread over the surface, or along a rope; vertices among them.

    Returns:
        None where the predicted points are some marked spots: then only they can be seen.
    """
    count = len(scenario.body.vertices)
    if not scenario.sampled and not np.array_equal(scenario.markers, np.eye(count)):
        return None
    body = scenario.body
    corners = body.elements if body.kind == "rope" else body.triangles
    cuts = _FINEST
    while cuts > 1 and len(corners) * (cuts + 1) * ((cuts + 2) / 2 if corners.shape[1] == 3 else 1) > _MOST:
        cuts -= 1
    steps = np.arange(cuts + 1)
    if corners.shape[1] == 2:
        shares = np.stack([steps, cuts - steps], axis=1) / cuts
    else:
        i, j = (x.ravel() for x in np.meshgrid(steps, steps, indexing="ij"))
        inside = i + j <= cuts
        shares = np.stack([i, j, cuts - i - j], axis=1)[inside] / cuts
    rows = np.repeat(np.arange(len(corners) * len(shares)), corners.shape[1])
    columns = np.repeat(corners[:, None], len(shares), axis=1).ravel()
    weights = np.tile(shares, (len(corners), 1, 1)).ravel()
    return sparse.csr_array((weights, (rows, columns)), shape=(len(corners) * len(shares), count))
