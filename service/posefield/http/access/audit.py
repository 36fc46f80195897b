"""Audit log: one line of JSON for each refused access.

A line holds the name of the key or a pseudonym of the token, the request id, the path template and
the reason; it holds no key, no token, no query and no value of a path parameter.
"""

import logging
from typing import NamedTuple

import orjson

log = logging.getLogger(__name__)


class AuditedRequest(NamedTuple):
    """A request in the audit log.

    request: its id. method: HTTP method. path: path template of the contract, not the requested
    path.
    """

    request: str
    method: str
    path: str


def log_refusal(call: AuditedRequest, status: int, who: str, why: str) -> None:
    """Log a refused request.

    status: of the response. who: name of the principal. why: reason of the refusal.
    """
    told = {"audit": "refused", "status": status, **call._asdict(), "who": who, "why": why}
    log.warning("%s", orjson.dumps(told).decode())
