"""Deadlines: maximum time until a response begins."""

import asyncio
import re
from asyncio import Task
from collections.abc import Awaitable
from typing import Any, TypeVar

from posefield.http.api.problems import DEADLINE_EXCEEDED, RequestError
from posefield.http.telemetry import metrics

Result = TypeVar("Result")

CHECK_INTERVAL = 0.1
"""Seconds between two checks: a timer per request would take a tenth of a pose request's time."""

# RFC 7240, 4.3: time after which the client needs no response, s.
_WAIT = re.compile(rb"(?:^|[,;\s])wait\s*=\s*([0-9]{1,6})(?![0-9])", re.IGNORECASE)


def requested_deadline(prefer: bytes | None, most: float) -> float:
    """Return the deadline of a request, s: `wait` of its Prefer header, at most `most`."""
    found = _WAIT.search(prefer) if prefer else None
    return min(most, float(found[1])) if found else most


class DeadlineTimer:
    """Requests of an event loop with their deadlines."""

    def __init__(self) -> None:
        self._until: dict[Task[Any], float] = {}
        self._late: set[Task[Any]] = set()
        self._checking = False

    async def within(self, limit: float, answer: Awaitable[Result]) -> Result:
        """Await a response; raises RequestError 503 if it takes longer than `limit` seconds.

        The awaiting task is cancelled then, and `worker_threads.run_in_thread` asks the thread's
        work to stop.
        """
        task, loop = asyncio.current_task(), asyncio.get_running_loop()
        assert task is not None
        self._until[task] = loop.time() + limit
        if not self._checking:
            self._checking = True
            loop.call_later(CHECK_INTERVAL, self._check)
        try:
            return await answer
        except asyncio.CancelledError:
            if task not in self._late:
                raise
            task.uncancel()
            detail = f"no answer within {limit:g} s"
            raise RequestError(DEADLINE_EXCEEDED, detail, headers={"Retry-After": "1"}) from None
        finally:
            del self._until[task]
            self._late.discard(task)

    def _check(self) -> None:
        loop = asyncio.get_running_loop()
        self._checking = bool(self._until)
        if self._checking:
            loop.call_later(CHECK_INTERVAL, self._check)
        now = loop.time()
        metrics.set_open_requests(len(self._until))
        late = [task for task, until in self._until.items() if until < now]
        for task in late:
            if task not in self._late:
                self._late.add(task)
                task.cancel()
