"""Which representation a client prefers, RFC 9110, 12.5.1.

A path without a format asks the header Accept; one with a format never does. What of the header
cannot be read counts for nothing, for clients of old send the like of `*; q=.2` beside what can.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

from starlette.requests import Request
from starlette.responses import Response

from service.web.problems import NOT_ACCEPTABLE, RequestFault
from service.web.service import Handler, Service

VARY = "Accept"
LONG = 1000
Offers = tuple[tuple[str, str], ...]
"""Names of formats and their media types, the usual one first."""


class Format(Protocol):
    """What has a media type: an encoder or a pack."""

    @property
    def media_type(self) -> str:
        """As it stands in Content-Type."""


_TOKEN = r"[!#$%&'*+.^_`|~0-9A-Za-z-]++"
_QUOTED = r'"(?:[^"\\]|\\.)*+"'
_MEMBER = re.compile(rf"(?:{_QUOTED}|[^,\"])++")
_RANGE = re.compile(
    rf"\s*+({_TOKEN})/({_TOKEN})((?:\s*+;\s*+(?:{_TOKEN}=(?:{_TOKEN}|{_QUOTED}))?+)*+)\s*+"
)
_PARAMETER = re.compile(rf"({_TOKEN})=({_TOKEN}|{_QUOTED})")
_WEIGHT = re.compile(r"[01]|[01]?\.[0-9]*+", re.ASCII)
UTF8 = ("charset", "utf-8")
"""The one parameter that says nothing: all text of ours is in UTF-8."""


@dataclass(frozen=True)
class _Range:
    """A member of Accept: `*` stands for any kind, and any subtype of a kind."""

    kind: str
    subtype: str
    weight: float

    def precedence(self, media_type: str) -> int:
        """How closely it names a media type: 2 by its name, 1 by its kind, 0 as any; -1 for no."""
        kind, _, subtype = media_type.partition("/")
        if (self.kind, self.subtype) == (kind, subtype):
            return 2
        if (self.kind, self.subtype) == (kind, "*"):
            return 1
        return 0 if (self.kind, self.subtype) == ("*", "*") else -1


@dataclass(frozen=True)
class Negotiated:
    """Handler that answers by whichever of the handlers makes what the client prefers, which has
    been found before it is called.

    offers: names and media types of what there is a handler of, the usual one first.
    """

    offers: Offers
    handlers: Mapping[str, Handler]

    async def __call__(self, service: Service, request: Request) -> Response:
        return await self.handlers[request.scope["format"]](service, request)


def format_of(request: Request, offers: Offers) -> str:
    """Format that the request prefers; RequestFault where it accepts none."""
    lines = [value.decode("latin-1") for name, value in request["headers"] if name == b"accept"]
    if not lines:
        return offers[0][0]
    accept = ", ".join(lines)
    # A long one is not worth remembering: 256 of them would be megabytes.
    find = preferred if len(accept) <= LONG else preferred.__wrapped__
    found = find(accept, offers)
    if found is None:
        there = ", ".join(media_type for _, media_type in offers)
        detail = f"Accept {accept[:200]!r}, expected one of {there}"
        raise RequestFault(NOT_ACCEPTABLE, detail, headers={"Vary": VARY})
    return found


# The same few clients send the same few headers; what others send is soon forgotten.
@lru_cache(maxsize=256)
def preferred(accept: str, offers: Offers) -> str | None:
    """Format of the greatest weight, of equals the one that is named most closely, and of those the
    first; None where all have the weight 0.

    An empty header accepts everything.
    """
    if not accept.strip():
        return offers[0][0]
    ranges = list(_ranges(accept))
    best, found = (0.0, -1), None
    for name, media_type in offers:
        own = max(((r.precedence(media_type), r.weight) for r in ranges), default=(-1, 0.0))
        if own[0] >= 0 and own[1] > 0.0 and own[::-1] > best:
            best, found = own[::-1], name
    return found


def _ranges(accept: str) -> Iterator[_Range]:
    """Members that can be read, and that an offer of ours, which has no parameters, may match."""
    for member in _MEMBER.finditer(accept):
        found = _RANGE.fullmatch(member[0])
        weight = _weight(found[3]) if found else None
        if found and weight is not None:
            yield _Range(found[1].lower(), found[2].lower(), weight)


def _weight(parameters: str) -> float | None:
    """Weight of a member; None where it is none, or other parameters narrow the member down."""
    for name, value in _PARAMETER.findall(parameters):
        if name.lower() == "q":
            return min(float(value), 1.0) if _WEIGHT.fullmatch(value) and value != "." else None
        if (name.lower(), value.strip('"').lower()) != UTF8:
            return None
    return 1.0
