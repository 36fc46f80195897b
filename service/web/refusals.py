"""Why a request is refused before any operation is known, in the words of a RequestFault."""

from typing import NamedTuple

import httptools

from service.web.patience import FIELDS, Limits
from service.web.problems import (
    HEAD_TOO_LARGE,
    MALFORMED,
    NO_CONNECTION_LEFT,
    TOO_SLOW,
    URL_TOO_LONG,
    RequestFault,
)


class Head(NamedTuple):
    """Head of a request; hosts: how many it names, codings: its values of Transfer-Encoding."""

    url: bytes
    headers: list[tuple[bytes, bytes]]
    hosts: int
    codings: list[bytes]
    version: str


def of_head(head: Head, limits: Limits) -> RequestFault | None:
    """What is wrong with a head, if anything is."""
    if len(head.url) > limits.url:
        return too_long(limits)
    size = sum(len(name) + len(value) + 4 for name, value in head.headers)
    if size > limits.head or len(head.headers) > FIELDS:
        return too_large(limits)
    if head.version not in ("1.1", "1.0"):
        return malformed(f"HTTP/{head.version}, expected HTTP/1.1")
    if head.hosts != 1 and (head.version == "1.1" or head.hosts):
        # Who reads one of two, and who the other, do not see the same request (RFC 9112, 3.2).
        return malformed(f"{head.hosts} Host headers, expected one")
    if head.codings and (head.codings != [b"chunked"] or head.version != "1.1"):
        return malformed("Transfer-Encoding, expected none or chunked")
    return None


def of_parser(broken: httptools.HttpParserError) -> RequestFault:
    """What the parser says of a request that it cannot read."""
    if isinstance(broken, httptools.HttpParserCallbackError):
        return malformed("its URL cannot be read")
    return malformed(f"{broken}")


def malformed(detail: str) -> RequestFault:
    """Of what is no HTTP as it is read here."""
    return RequestFault(MALFORMED, detail)


def too_long(limits: Limits) -> RequestFault:
    """Of a URL."""
    return RequestFault(
        URL_TOO_LONG, f"more than {limits.url} bytes, expected at most {limits.url}"
    )


def too_large(limits: Limits) -> RequestFault:
    """Of a head."""
    detail = f"expected at most {limits.head} bytes in at most {FIELDS} headers"
    return RequestFault(HEAD_TOO_LARGE, detail)


def too_slow(what: str, seconds: int) -> RequestFault:
    """Of a head or a body."""
    return RequestFault(TOO_SLOW, f"its {what} was expected within {seconds} seconds")


def no_connection_left(limits: Limits) -> RequestFault:
    """Of a connection too many."""
    detail = f"{limits.connections} are open, expected fewer"
    return RequestFault(NO_CONNECTION_LEFT, detail, headers={"Retry-After": "1"})
