"""Temporary mesh files: Bullet takes soft bodies only from disk."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def node_file(count: int) -> Iterator[str]:
    """Path of a Wavefront ``.obj`` of a name never used before, removed on leaving.

    All that is wanted of Bullet are ``count`` nodes. It has no such body: it needs faces that make the nodes
    one connected piece (it hangs on loose ones), with corners that differ. A zigzag strip is the least, and costs
    half of what a whole mesh does. Where the nodes are is said later.
    """
    points = [f"v {0.01 * k:.3f} {0.01 * (k % 2):.3f} 0" for k in range(count)]
    faces = [f"f {k} {k + 1} {k + 2}" for k in range(1, count - 1)]
    handle, path = tempfile.mkstemp(suffix=".obj", prefix="muslin-")
    try:
        with os.fdopen(handle, "w") as file:
            file.write("\n".join([*points, *faces]) + "\n")
        yield path
    finally:
        os.unlink(path)
