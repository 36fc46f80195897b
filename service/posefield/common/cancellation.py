"""Cancellation of work whose client has gone, turns and numbers of threads, and progress.

A request handler sets `current`; loops that may take longer than a tenth of a second call `check`.
anyio.to_thread.run_sync copies the caller's context into its threads; `bind_context` does so for
the threads of other pools.
"""

import threading
import time
from collections.abc import Callable
from contextvars import ContextVar, copy_context
from typing import ParamSpec, TypeVar

ProgressCallback = Callable[[int, int], None]
"""Function of the number of finished units and of their total."""


def ignore_progress(done: int, total: int) -> None:
    """Show nothing."""


Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


YIELD_INTERVAL = 0.002
"""Seconds of work after which a thread releases Python's lock."""
YIELD_SLEEP = 0.00005
"""Seconds of sleep in which another thread acquires the lock; less is often too short."""


class Cancelled(Exception):
    """Raised by `check` after the current work has been cancelled."""


class Cancellation:
    """Flag of one request, set once by any thread."""

    def __init__(self) -> None:
        self._event = threading.Event()
        self._paused = time.perf_counter()

    def cancel(self) -> None:
        """Request that the work stops."""
        self._event.set()

    @property
    def requested(self) -> bool:
        """Return whether the work should stop."""
        return self._event.is_set()

    def check(self) -> None:
        """Raise Cancelled if the work should stop; otherwise sleep briefly.

        It sleeps YIELD_SLEEP s once in YIELD_INTERVAL s. Without the sleep, threads that wait for
        Python's lock get it after 5 ms and in no fixed order: an event loop beside several busy
        threads would wait for most of them.
        """
        if self.requested:
            raise Cancelled
        if time.perf_counter() - self._paused > YIELD_INTERVAL:
            time.sleep(YIELD_SLEEP)
            self._paused = time.perf_counter()


current: ContextVar[Cancellation | None] = ContextVar("cancellation", default=None)
"""Cancellation of the work of this context; None for work that always runs to its end."""


def check() -> None:
    """Raise Cancelled if the current work has been cancelled; otherwise let other threads run."""
    cancellation = current.get()
    if cancellation is not None:
        cancellation.check()


def bind_context(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Return a function that runs in a copy of this context, in whichever thread it is called.

    It first calls `check`, so that tasks which still wait in a pool end at once.
    """
    context = copy_context()

    def call(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        # A context can be entered by one thread at a time: each call has a copy of its own.
        copy = context.copy()
        copy.run(check)
        return copy.run(function, *args, **kwargs)

    return call


SINGLE_THREAD_ENV = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"
)
"""Environment of a worker process where there is one worker per core.

With more than one BLAS thread each, the threads of all workers would wait for each other.
"""
