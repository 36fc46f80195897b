"""Work of requests in threads, with limits by kind of work, and cancellation."""

import asyncio
import logging
import math
import os
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar, TypeVarTuple

from anyio import CancelScope, CapacityLimiter, to_thread

from posefield.common import cancellation as cancel
from posefield.common.cancellation import Cancellation, Cancelled

faults = logging.getLogger(__name__)

Result = TypeVar("Result")
Arguments = TypeVarTuple("Arguments")

CORES = os.cpu_count() or 1
SYNTHESIS_LIMITER = CapacityLimiter(CORES)
"""Limit on threads for work of up to tenths of a second: long clips, lists of times, grids,
compression. More threads than cores would delay the event loop several times as long (decision
0030)."""
SOLVER_LIMITER = CapacityLimiter(CORES)
CROWD_LIMITER = CapacityLimiter(CORES)
ARCHIVE_LIMITER = CapacityLimiter(CORES)
"""Limits on threads for work of seconds, separate so that other work does not wait for it."""

# The limiters above count the threads; anyio's own limit must not apply.
_UNBOUNDED = CapacityLimiter(math.inf)


async def run_in_thread(
    work: Callable[[*Arguments], Result],
    *arguments: *Arguments,
    places: CapacityLimiter = SYNTHESIS_LIMITER,
) -> Result:
    """Call `work` in a thread within the limit `places`, and return its result.

    If the awaiting task is cancelled, the work is asked to stop (`posefield.common.cancellation`),
    and counts against the limit until it has stopped.
    """
    async with places:
        return await within(work, *arguments)


async def within(work: Callable[[*Arguments], Result], *arguments: *Arguments) -> Result:
    """Call `work` in a thread as `run_in_thread` does, for a caller that holds a place already."""
    cancellation = Cancellation()
    token = cancel.current.set(cancellation)
    try:
        thread = asyncio.ensure_future(to_thread.run_sync(work, *arguments, limiter=_UNBOUNDED))
    finally:
        cancel.current.reset(token)
    try:
        return await asyncio.shield(thread)
    except asyncio.CancelledError:
        cancellation.cancel()
        await _wait_until_ended(thread)
        raise


async def _wait_until_ended(thread: "asyncio.Future[Result]") -> None:
    """Wait until a thread has ended, even if the waiting task is cancelled again.

    Log the exception of work that failed for another reason than its cancellation.
    """
    # anyio repeats a cancellation, asyncio delivers it once: the scope shields from the former.
    with CancelScope(shield=True):
        while not thread.done():
            with suppress(asyncio.CancelledError):
                await asyncio.wait({thread})
    fault = thread.exception()
    if fault is not None and not isinstance(fault, Cancelled):
        faults.error("work that no client waits for has failed", exc_info=fault)
