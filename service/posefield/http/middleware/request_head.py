"""Checks of a request's head: length of the URL, size of the headers, and the Host.

A page of another origin can make a browser send requests to a local service under the page's host
name (DNS rebinding). The browser then sends that name as Host, not an address or a listed name.
"""

import ipaddress
from dataclasses import dataclass, field

from starlette.types import Scope

from posefield.common.errors import InvalidField
from posefield.http.api.problems import HEAD_TOO_LARGE, UNKNOWN_HOST, URL_TOO_LONG, RequestError

LOOPBACK = ("localhost",)
"""Default of the accepted host names; IP addresses are always accepted."""
MAX_FIELDS = 100
"""Maximum number of header lines of a request; browsers send 20."""


@dataclass(frozen=True)
class HeadLimits:
    """Limits on request heads.

    url: maximum bytes of the path and query. headers: maximum bytes of all headers. names: accepted
    host names in lower case; a name with a leading dot matches as a suffix, "*" matches all.
    """

    url: int
    headers: int
    names: tuple[str, ...]
    _known: set[bytes] = field(default_factory=set)

    def check(self, scope: Scope) -> None:
        """Raise RequestError for a long URL (414), large headers (431) or an unknown host (421)."""
        # raw_path is optional in ASGI.
        path = scope.get("raw_path") or scope["path"].encode()
        if len(path) + len(scope["query_string"]) > self.url:
            raise RequestError(URL_TOO_LONG, f"expected at most {self.url} bytes")
        size, hosts, count = 0, [], 0
        for name, value in scope["headers"]:
            size += len(name) + len(value)
            count += 1
            if name == b"host":
                hosts.append(value)
        if size > self.headers or count > MAX_FIELDS:
            detail = f"expected at most {self.headers} bytes in at most {MAX_FIELDS} headers"
            raise RequestError(HEAD_TOO_LARGE, detail)
        # HTTP/1.0 has no Host; load balancers still use it for health checks.
        if len(hosts) > 1 or (not hosts and scope["http_version"] != "1.0"):
            raise RequestError(UNKNOWN_HOST, f"{len(hosts)} Host headers, expected one")
        if hosts and hosts[0] not in self._known:
            self._check_host(hosts[0])

    def _check_host(self, given: bytes) -> None:
        name = _without_port(given.decode("latin-1").lower())
        if not (_is_address(name) or any(_matches(name, known) for known in self.names)):
            expected = ", ".join(_joined_names(known) for known in self.names)
            detail = f"{name[:100]!r}, expected an address or one of {expected} (POSEFIELD_HOSTS)"
            raise RequestError(UNKNOWN_HOST, detail)
        # Bounded: clients can make up any number of accepted Host values.
        if len(self._known) < 100:
            self._known.add(given)


def names(text: str, setting: str) -> tuple[str, ...]:
    """Return host names of a text with commas between, LOOPBACK for an empty one.

    `*.example.com` stands for all names below `example.com`, `*` for all names. Raises
    InvalidField, which names the setting, for a name with a port or a scheme.
    """
    found = [part.strip().lower() for part in text.split(",") if part.strip()]
    for name in found:
        if name != "*" and not _NAME.issuperset(name.removeprefix("*.")):
            raise InvalidField(setting, f"{name!r}, expected names as example.com, *.example.com")
    return tuple(name.removeprefix("*") if name != "*" else name for name in found) or LOOPBACK


_NAME = frozenset("abcdefghijklmnopqrstuvwxyz0123456789.-_")


def _matches(name: str, known: str) -> bool:
    return known in ("*", name) or (known.startswith(".") and name.endswith(known))


def _joined_names(known: str) -> str:
    return f"*{known}" if known.startswith(".") else known


def _without_port(given: str) -> str:
    if given.startswith("["):
        return given[1:].partition("]")[0]
    return given.partition(":")[0].removesuffix(".")


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
