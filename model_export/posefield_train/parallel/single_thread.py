"""Linear algebra limited to one thread."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock

from threadpoolctl import threadpool_limits

_LOCK = RLock()


@contextmanager
def single_threaded() -> Iterator[None]:
    """Run the block on one BLAS thread, in one Python thread of this process at a time.

    Small matrices gain nothing from more threads, and the order of a sum would depend on their
    number; one thread gives the same bytes on every machine. The limit applies to the whole
    process, so the lock prevents one block from lifting it for another.
    """
    with _LOCK, threadpool_limits(1):
        yield
