"""The audit log: one line of JSON for each access that was refused.

Who by the name of their key or a pseudonym of their token, the request's id, the contract's path
and why. Never a key, a token, a query or what stood in the place of a name.
"""

import logging
from typing import NamedTuple

import orjson

log = logging.getLogger(__name__)


class Call(NamedTuple):
    """A request as the log names it; path is the contract's template, never what was asked for."""

    request: str
    method: str
    path: str


def refused(call: Call, status: int, who: str, why: str) -> None:
    """Write down that somebody was refused."""
    told = {"audit": "refused", "status": status, **call._asdict(), "who": who, "why": why}
    log.warning("%s", orjson.dumps(told).decode())
