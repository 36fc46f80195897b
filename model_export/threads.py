"""Linear algebra on one thread, whatever runs beside it."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock

from threadpoolctl import threadpool_limits

_TURN = RLock()


@contextmanager
def one() -> Iterator[None]:
    """Everything inside is computed on one thread, and by one at a time in this process.

    Matrices as small as ours gain nothing from more threads, and a sum's order would hang on how
    many the machine has: one thread makes the same bytes everywhere. The limit is the process's:
    of two who came in together, the first to leave would lift it for the other.
    """
    with _TURN, threadpool_limits(1):
        yield
