"""Questions to a service over HTTP: whole answers, in time, or a fault."""

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

CONTRACT = "2"
"""Major version of the interface that this add-on speaks."""

LARGEST = 512 * 1024 * 1024
"""Bytes of an answer; ten thousand frames of a hundred joints take 16 million."""

PIECE = 1 << 16


@dataclass(frozen=True)
class Service:
    """Where a service is and who asks it.

    address: http or https, without a path or with the one that it is mounted at. key: sent as
    bearer, where there is one. seconds: that an answer may take. until: the moment of
    time.monotonic() by which every answer must be there. Raises BadAddress.
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
        """Whether it runs on this machine."""
        host = str(_parts(self.address).hostname)
        if host == "localhost":
            return True
        try:
            return ipaddress.ip_address(host).is_loopback
        except ValueError:
            return False

    @property
    def is_secret(self) -> bool:
        """Whether nobody on the way can read what is asked, the key for one."""
        return self.is_here or _parts(self.address).scheme == "https"

    def in_all(self) -> "Service":
        """The same, from now on: all answers together may take what one may."""
        return replace(self, until=time.monotonic() + self.seconds)


def check_version(service: Service) -> None:
    """Refuse what speaks another version of the interface; Unintelligible says which."""
    said = _object(fetch(service, "/livez"), service)
    if said.get("status") != "live":
        raise faults.Unintelligible(f"what answers at {service.address} is no posefield service")
    contract = str(said.get("contract", f"{CONTRACT}.0.0"))
    if contract.partition(".")[0] != CONTRACT:
        raise faults.Unintelligible(
            f"the service speaks version {contract} of its interface, this add-on {CONTRACT}.x"
        )


def models(service: Service) -> tuple[tuple[str, str], ...]:
    """Name and description of each model."""
    check_version(service)
    listed = _object(fetch(service, "/v1/models"), service)
    try:
        return tuple((str(each["name"]), str(each["description"])) for each in listed["models"])
    except (KeyError, TypeError) as fault:
        raise faults.Unintelligible(f"the list of models has no {fault}") from fault


def path_of(model: str) -> str:
    """Where a model is asked, whatever letters its name has."""
    return "/v1/models/" + urllib.parse.quote(model, safe="@")


def fetch(service: Service, path: str, body: Mapping[str, Any] | None = None) -> bytes:
    """A whole answer to a GET, or where there is a body to a POST of it as JSON.

    Raises BadAddress, Unreachable, TimedOut, CutOff, or Refused as the service says.
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
        # Names that no machine can have, such as labels of more than 63 letters.
        raise faults.BadAddress(f"the address is {service.address!r}: {fault}") from fault


class _Stay(urllib.request.HTTPRedirectHandler):
    """Follows nobody: urllib would take the key along to another machine."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        return None


def _opener(service: Service, until: float) -> urllib.request.OpenerDirector:
    """Whoever is told of a proxy by the environment need not except this machine from it."""
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
    """All bytes of an answer; http.client does not tell by itself when some are missing."""
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
        _ = parts.port  # Looked at for what it raises.
        return parts
    except ValueError as fault:
        raise faults.BadAddress(f"the address is {address!r}: {fault}") from fault
