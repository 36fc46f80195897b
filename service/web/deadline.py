"""How long an answer may take to begin."""

import asyncio
import re
from collections.abc import Awaitable
from typing import TypeVar

from service.web.problems import LATE, RequestFault

Answer = TypeVar("Answer")

# RFC 7240, 4.3: a client that has no use for an answer after so many seconds.
_WAIT = re.compile(rb"(?:^|[,;\s])wait\s*=\s*([0-9]{1,6})(?![0-9])", re.IGNORECASE)


def seconds(prefer: bytes | None, most: float) -> float:
    """The client's own patience, of a Prefer header, but never more than the service's."""
    found = _WAIT.search(prefer) if prefer else None
    return min(most, float(found[1])) if found else most


async def within(limit: float, answer: Awaitable[Answer]) -> Answer:
    """What is awaited; RequestFault where it takes longer than so many seconds.

    What runs in a thread goes on to its end, and holds its place there until then.
    """
    try:
        async with asyncio.timeout(limit):
            return await answer
    except TimeoutError:
        detail = f"no answer within {limit:g} s"
        raise RequestFault(LATE, detail, headers={"Retry-After": "1"}) from None
