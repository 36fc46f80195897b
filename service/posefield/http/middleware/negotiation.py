"""Content negotiation: choice of a response's format by the header Accept (RFC 9110, 12.5.1).

It applies to paths without a format; a path with a format ignores the header. Invalid members of
the header are skipped, since old clients send members like `*; q=.2`.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from starlette.requests import Request

from posefield.http.api.problems import NOT_ACCEPTABLE, RequestError

VARY = "Accept"
MAX_ACCEPT_LENGTH = 1000
Offers = tuple[tuple[str, str], ...]
"""Names and media types of formats, the default first."""

_TOKEN = r"[!#$%&'*+.^_`|~0-9A-Za-z-]++"
_QUOTED = r'"(?:[^"\\]|\\.)*+"'
_MEMBER = re.compile(rf"(?:{_QUOTED}|[^,\"])++")
_RANGE = re.compile(
    rf"\s*+({_TOKEN})/({_TOKEN})((?:\s*+;\s*+(?:{_TOKEN}=(?:{_TOKEN}|{_QUOTED}))?+)*+)\s*+"
)
_PARAMETER = re.compile(rf"({_TOKEN})=({_TOKEN}|{_QUOTED})")
_WEIGHT = re.compile(r"[01]|[01]?\.[0-9]*+", re.ASCII)
UTF8 = ("charset", "utf-8")
"""The parameter that is ignored: all text responses are in UTF-8."""


@dataclass(frozen=True)
class _MediaRange:
    """A media range of Accept, with its weight from 0 to 1; `*` matches any kind or subtype."""

    kind: str
    subtype: str
    weight: float

    def precedence(self, media_type: str) -> int:
        """Return how specifically the range matches a media type.

        2 for type and subtype, 1 for the type only, 0 for any type, -1 for no match.
        """
        kind, _, subtype = media_type.partition("/")
        if (self.kind, self.subtype) == (kind, subtype):
            return 2
        if (self.kind, self.subtype) == (kind, "*"):
            return 1
        return 0 if (self.kind, self.subtype) == ("*", "*") else -1


def negotiated_format(request: Request, offers: Offers) -> str:
    """Return the format that a request prefers; raises RequestError 406 if it accepts none."""
    lines = [value.decode("latin-1") for name, value in request["headers"] if name == b"accept"]
    if not lines:
        return offers[0][0]
    accept = ", ".join(lines)
    # Long headers are not cached: 256 of them would take megabytes.
    find = preferred_format if len(accept) <= MAX_ACCEPT_LENGTH else preferred_format.__wrapped__
    found = find(accept, offers)
    if found is None:
        there = ", ".join(media_type for _, media_type in offers)
        detail = f"Accept {accept[:200]!r}, expected one of {there}"
        raise RequestError(NOT_ACCEPTABLE, detail, headers={"Vary": VARY})
    return found


# Most clients send one of few headers; the cache evicts the others.
@lru_cache(maxsize=256)
def preferred_format(accept: str, offers: Offers) -> str | None:
    """Return the format of the greatest weight; None if no format is accepted.

    Among equal weights the most specific match wins, then the first offer. An empty header accepts
    everything.
    """
    if not accept.strip():
        return offers[0][0]
    ranges = list(_media_ranges(accept))
    best, found = (0.0, -1), None
    for name, media_type in offers:
        own = max(((r.precedence(media_type), r.weight) for r in ranges), default=(-1, 0.0))
        if own[0] >= 0 and own[1] > 0.0 and own[::-1] > best:
            best, found = own[::-1], name
    return found


def _media_ranges(accept: str) -> Iterator[_MediaRange]:
    """Yield the valid media ranges; skip those with parameters that no offer has."""
    for member in _MEMBER.finditer(accept):
        found = _RANGE.fullmatch(member[0])
        weight = _range_weight(found[3]) if found else None
        if found and weight is not None:
            yield _MediaRange(found[1].lower(), found[2].lower(), weight)


def _range_weight(parameters: str) -> float | None:
    """Return the weight of a member; None if it or a media type parameter excludes all offers."""
    for name, value in _PARAMETER.findall(parameters):
        if name.lower() == "q":
            return min(float(value), 1.0) if _WEIGHT.fullmatch(value) and value != "." else None
        if (name.lower(), value.strip('"').lower()) != UTF8:
            return None
    return 1.0
