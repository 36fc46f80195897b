"""HTTP requests to a service: complete responses within a time limit, or a Fault."""

import http.client
import ipaddress
import json
import math
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from . import faults, timely

CONTRACTS = ("3", "4")
"""Major versions of the contract that this add-on supports.

Version 4 removed `pin_feet`, which it never sent.
"""

LARGEST = 512 * 1024 * 1024
"""Limit of a response, bytes; ten thousand frames of a hundred joints take 16 million."""

PIECE = 1 << 16


@dataclass(frozen=True)
class Service:
    """Address and credentials of a service.

    address: http or https, optionally with the path that it is mounted at. key: bearer token, or
    "". seconds: time limit of a response. until: time.monotonic() at which all responses must be
    complete. Raises BadAddress.
    """

    address: str
    key: str = ""
    seconds: float = 5.0
    until: float = math.inf

    def __post_init__(self) -> None:
        parts = _parts(self.address)
        known = parts.scheme in ("http", "https") and parts.hostname and self.address.isascii()
        if not known or parts.query or parts.fragment:
            raise faults.BadAddress(
                f"the address is {self.address!r}, expected one like http://127.0.0.1:8000"
            )
        if not (self.key.isascii() and self.key.isprintable()):
            raise faults.BadAddress("the API key holds letters that no key has: copy it again")

    @property
    def is_here(self) -> bool:
        """Return True for a service on this machine."""
        host = str(_parts(self.address).hostname)
        if host == "localhost":
            return True
        try:
            return ipaddress.ip_address(host).is_loopback
        except ValueError:
            return False

    @property
    def is_secret(self) -> bool:
        """Return True if requests are encrypted or stay on this machine."""
        return self.is_here or _parts(self.address).scheme == "https"

    def in_all(self) -> "Service":
        """Return the service with one time limit for all further responses together."""
        return replace(self, until=time.monotonic() + self.seconds)


def check_version(service: Service) -> None:
    """Raise Unintelligible for another service, or another major version of the contract."""
    said = _object(fetch(service, "/livez"), service)
    if said.get("status") != "live":
        raise faults.Unintelligible(f"what answers at {service.address} is no posefield service")
    contract = str(said.get("contract", f"{CONTRACTS[0]}.0.0"))
    if contract.partition(".")[0] not in CONTRACTS:
        known = " and ".join(f"{each}.x" for each in CONTRACTS)
        raise faults.Unintelligible(
            f"the service speaks version {contract} of its interface, this add-on {known}"
        )


def models(service: Service) -> tuple[tuple[str, str], ...]:
    """Return name and description of each model."""
    check_version(service)
    listed = _object(fetch(service, "/v1/models"), service)
    try:
        return tuple((str(each["name"]), str(each["description"])) for each in listed["models"])
    except (KeyError, TypeError) as fault:
        raise faults.Unintelligible(f"the list of models has no {fault}") from fault


def path_of(model: str) -> str:
    """Return the path of a model, with its name quoted."""
    return "/v1/models/" + urllib.parse.quote(model, safe="@")


def fetch(service: Service, path: str, body: Mapping[str, Any] | None = None) -> bytes:
    """Return the complete response to a GET, or with a body to a POST of it as JSON.

    Raises BadAddress, Unreachable, TimedOut, CutOff, Unintelligible, or Refused.
    """
    request, begun = _request(service, path, body), time.monotonic()
    until = min(service.until, begun + service.seconds)
    if until <= begun:
        raise _slow(service)
    try:
        with _opener(service, until).open(request, timeout=until - begun) as answer:
            return _whole(answer, service)
    except urllib.error.HTTPError as refusal:
        with refusal:
            raise _refused(refusal, service) from None
    except urllib.error.URLError as fault:
        raise _unreachable(service, fault.reason) from fault
    except (http.client.IncompleteRead, ConnectionResetError) as fault:
        raise faults.CutOff(f"the answer of {service.address} broke off") from fault
    except (OSError, http.client.HTTPException) as fault:
        raise _unreachable(service, fault) from fault
    except ValueError as fault:
        # Invalid host names, such as labels of more than 63 characters.
        raise faults.BadAddress(f"the address is {service.address!r}: {fault}") from fault


class _Stay(urllib.request.HTTPRedirectHandler):
    """Redirect handler that refuses redirects; urllib would send the key to the other host."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        return None


def _opener(service: Service, until: float) -> urllib.request.OpenerDirector:
    """Return an opener that uses the environment's proxy except for this machine."""
    proxies = urllib.request.ProxyHandler({} if service.is_here else None)
    return timely.opener(until, _Stay, proxies)


def _request(service: Service, path: str, body: Mapping[str, Any] | None) -> urllib.request.Request:
    headers = {"User-Agent": "posefield-blender"}
    if service.key:
        headers["Authorization"] = f"Bearer {service.key}"
    data = None
    if body is not None:
        headers["Content-Type"] = "application/json"
        data = json.dumps(body, allow_nan=False).encode()
    address = urllib.parse.urlunsplit(_parts(service.address)).rstrip("/")
    return urllib.request.Request(address + path, data, headers)


def _whole(answer: http.client.HTTPResponse, service: Service) -> bytes:
    """Return all bytes of a response; http.client does not report missing ones with read1."""
    expected = answer.length
    if expected is None and not answer.chunked:
        raise faults.CutOff(f"the answer of {service.address} does not say where it ends")
    content = bytearray()
    while piece := answer.read1(PIECE):
        content += piece
        if len(content) > LARGEST:
            raise faults.Unintelligible(f"an answer of more than {LARGEST} bytes: not read on")
    if expected is not None and len(content) != expected:
        raise faults.CutOff(
            f"the answer of {service.address} broke off after {len(content)} of {expected} bytes"
        )
    return bytes(content)


def _refused(refusal: urllib.error.HTTPError, service: Service) -> faults.Fault:
    if 300 <= refusal.code < 400:
        return faults.Unintelligible(
            f"{service.address} sends elsewhere ({refusal.code}); give the service's own address"
        )
    try:
        return faults.of_problem(refusal.code, refusal.read(PIECE))
    except TimeoutError:
        return _slow(service)
    except (OSError, http.client.HTTPException):
        return faults.of_problem(refusal.code, b"")


def _unreachable(service: Service, reason: object) -> faults.Fault:
    if isinstance(reason, TimeoutError):
        return _slow(service)
    return faults.Unreachable(f"no service answers at {service.address}: {reason}")


def _slow(service: Service) -> faults.Fault:
    return faults.TimedOut(f"{service.address} did not answer within {service.seconds:g} s")


def _object(content: bytes, service: Service) -> dict[str, Any]:
    try:
        found = json.loads(content)
    except ValueError as fault:
        raise faults.Unintelligible(f"{service.address} answers no JSON: {fault}") from fault
    if not isinstance(found, dict):
        raise faults.Unintelligible(f"{service.address} answers a {type(found).__name__}")
    return found


def _parts(address: str) -> urllib.parse.SplitResult:
    try:
        parts = urllib.parse.urlsplit(address.strip())
        _ = parts.port  # Raises ValueError for an invalid port.
        return parts
    except ValueError as fault:
        raise faults.BadAddress(f"the address is {address!r}: {fault}") from fault
