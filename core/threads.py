"""How many threads linear algebra takes."""

from threadpoolctl import threadpool_limits


def one_thread() -> threadpool_limits:
    """A context in which numpy's linear algebra takes one thread.

    Its matrices are small here, and threads that wait for a busy core take longer than the work. torch, which has
    threads of its own, is left as it is.
    """
    return threadpool_limits(1, user_api="blas")
