"""Temporary mesh files: Bullet takes soft bodies only from disk."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

#: Nodes that come after those asked for.
HUB = 2


@contextmanager
def node_file(count: int) -> Iterator[str]:
    """Path of a Wavefront ``.obj`` of a name never used before, removed on leaving.

    All that is wanted of Bullet are ``count`` nodes. It has no such body: it needs faces that make the nodes
    one connected piece (it hangs on loose ones), with corners that differ. Here every node has a face of its own
    with two more nodes, the hub, that all faces share. Where nodes that touch something share a face, Bullet
    takes that face to touch too, although it is told not to, and its solution for all is then wrong by as much as
    the nodes' velocities; with the hub out of reach every contact is right to rounding. Where the nodes are is
    said later.
    """
    points = [f"v {0.01 * k:.2f} {0.01 * (k % 2):.2f} 0" for k in range(count + HUB)]
    faces = [f"f {k} {count + 1} {count + 2}" for k in range(1, count + 1)]
    handle, path = tempfile.mkstemp(suffix=".obj", prefix="muslin-")
    try:
        with os.fdopen(handle, "w") as file:
            file.write("\n".join([*points, *faces]) + "\n")
        yield path
    finally:
        os.unlink(path)
