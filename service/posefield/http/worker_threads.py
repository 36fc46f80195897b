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
HALF = max(1, CORES // 2)
POSE_LIMITER = CapacityLimiter(CORES)
"""Limit on threads for poses that take milliseconds, which wait for no other work."""
SYNTHESIS_LIMITER = CapacityLimiter(HALF)
"""Limit on threads for work of up to tenths of a second: clips with targets or standing feet, long
clips, grids, compression. More threads would delay the event loop and poses several times as long:
each holds Python's lock in turn (decision 0030)."""
PERFORMANCE_LIMITER = CapacityLimiter(HALF)
LONG_LIMITER = CapacityLimiter(1)
CROWD_LIMITER = CapacityLimiter(HALF)
ARCHIVE_LIMITER = CapacityLimiter(CORES)
"""Limits on threads for work of seconds, separate so that other work does not wait for it. Long
performances and those of archives are made one at a time: each may take all memory for answers."""
SWITCH_INTERVAL = 0.001
"""Seconds after which a thread lets others run Python, such as the event loop that answers poses;
Python's default of 5 ms is that long for each thread before it."""

# The limiters above count the threads; anyio's own limit must not apply.
_UNBOUNDED = CapacityLimiter(math.inf)


async def run_in_thread(
    work: Callable[[*Arguments], Result],
    *arguments: *Arguments,
    limiter: CapacityLimiter = SYNTHESIS_LIMITER,
) -> Result:
    """Call `work` in a thread within a limit, and return its result.

    If the awaiting task is cancelled, the work is asked to stop (`posefield.common.cancellation`),
    and counts against the limit until it has stopped.
    """
    async with limiter:
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
