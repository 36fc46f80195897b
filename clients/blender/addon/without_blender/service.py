"""HTTP requests to a service by urllib: complete responses within a time limit, or a Fault."""

import http.client
import ipaddress
import json
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Mapping
from dataclasses import dataclass
from email.message import Message
from typing import Any

CONTRACT = "5"
"""Major version of the contract that this add-on speaks."""
LARGEST = 512 * 1024 * 1024
"""Limit of a response, bytes."""
PIECE = 1 << 16


class Fault(Exception):
    """Error of a request or an import; the text names the found and the expected value."""


@dataclass(frozen=True)
class Answer:
    """A response: its bytes and its headers."""

    content: bytes
    headers: Message

    @property
    def document(self) -> dict[str, Any]:
        """Return the content as a JSON object; raise Fault for other content."""
        try:
            found = json.loads(self.content)
        except ValueError as fault:
            raise Fault(f"the service answers no JSON: {fault}") from fault
        if not isinstance(found, dict):
            raise Fault(f"the service answers a {type(found).__name__}, expected an object")
        return found

    @property
    def sentences(self) -> list[str]:
        """Return how far the motion is to be trusted, and its warnings."""
        sigma, supported = (self.headers.get(f"Posefield-{n}") for n in ("Sigma", "Supported"))
        near = "captured near here" if supported == "true" else "nothing like it was captured"
        said = [] if sigma is None else [f"off by about {100 * float(sigma):.1f} cm; {near}"]
        return said + [json.loads(text) for text in self.headers.get_all("Posefield-Warning", [])]


@dataclass(frozen=True)
class Service:
    """Address and credentials of a service.

    address: http or https, optionally with the path that it is mounted at. key: bearer token, or
    "". seconds: time limit of a response. Raises Fault.
    """

    address: str
    key: str = ""
    seconds: float = 5.0

    def __post_init__(self) -> None:
        parts = self._parts()
        known = parts.scheme in ("http", "https") and parts.hostname and self.address.isascii()
        if not known or parts.query or parts.fragment:
            raise Fault(f"the address is {self.address!r}, expected one like http://127.0.0.1:8000")
        if not (self.key.isascii() and self.key.isprintable()):
            raise Fault("the API key holds letters that no key has: copy it again")

    @property
    def is_here(self) -> bool:
        """Return True for a service on this machine."""
        host = str(self._parts().hostname)
        try:
            return host == "localhost" or ipaddress.ip_address(host).is_loopback
        except ValueError:
            return False

    @property
    def is_secret(self) -> bool:
        """Return True if requests are encrypted or stay on this machine."""
        return self.is_here or self._parts().scheme == "https"

    def check_version(self) -> None:
        """Raise Fault for another service, or another major version of the contract."""
        said = self.fetch("/livez").document
        if said.get("status") != "live":
            raise Fault(f"what answers at {self.address} is no posefield service")
        contract = str(said.get("contract"))
        if contract.partition(".")[0] != CONTRACT:
            raise Fault(
                f"the service speaks version {contract} of its interface, this add-on {CONTRACT}.x"
            )

    def fetch(self, path: str, body: Mapping[str, Any] | None = None) -> Answer:
        """Return the complete response to a GET, or with a body to a POST of it as JSON.

        Raises Fault where no service answers in time, and with the problem of a refusal.
        """
        until = time.monotonic() + self.seconds
        try:
            with self._opener().open(self._request(path, body), timeout=self.seconds) as answer:
                return Answer(self._whole(answer, until), answer.headers)
        except urllib.error.HTTPError as refusal:
            with refusal:
                raise self._refused(refusal) from None
        except (OSError, http.client.HTTPException, ValueError) as fault:
            reason = getattr(fault, "reason", fault)
            if isinstance(reason, TimeoutError):
                words = f"{self.address} did not answer within {self.seconds:g} s"
            else:
                words = f"no service answers at {self.address}: {reason}"
            raise Fault(words) from fault

    def _opener(self) -> urllib.request.OpenerDirector:
        # The environment's proxy cannot reach this machine.
        return urllib.request.build_opener(
            _Stay, urllib.request.ProxyHandler({} if self.is_here else None)
        )

    def _request(self, path: str, body: Mapping[str, Any] | None) -> urllib.request.Request:
        headers = {"User-Agent": "posefield-blender"}
        if self.key:
            headers["Authorization"] = f"Bearer {self.key}"
        data = None
        if body is not None:
            headers["Content-Type"] = "application/json"
            data = json.dumps(body, allow_nan=False).encode()
        address = urllib.parse.urlunsplit(self._parts()).rstrip("/")
        return urllib.request.Request(address + path, data, headers)

    def _whole(self, answer: http.client.HTTPResponse, until: float) -> bytes:
        # The socket's own timeout begins again with each piece; http.client does not report
        # missing bytes with read1.
        expected, content = answer.length, bytearray()
        while piece := answer.read1(PIECE):
            content += piece
            if time.monotonic() > until:
                raise TimeoutError
            if len(content) > LARGEST:
                raise Fault(f"an answer of more than {LARGEST} bytes: not read on")
        if expected is not None and len(content) != expected:
            raise Fault(f"the answer broke off after {len(content)} of {expected} bytes")
        return bytes(content)

    def _refused(self, refusal: urllib.error.HTTPError) -> Fault:
        if 300 <= refusal.code < 400:
            return Fault(f"{self.address} sends elsewhere ({refusal.code}); give its own address")
        try:
            problem = json.loads(refusal.read(PIECE))
            return Fault(f"{problem['title']} ({refusal.code}): {problem['detail']}")
        except (OSError, http.client.HTTPException, ValueError, KeyError, TypeError):
            return Fault(f"the service refuses the question ({refusal.code}) and says no reason")

    def _parts(self) -> urllib.parse.SplitResult:
        try:
            parts = urllib.parse.urlsplit(self.address.strip())
            _ = parts.port  # Raises ValueError for an invalid port.
            return parts
        except ValueError as fault:
            raise Fault(f"the address is {self.address!r}: {fault}") from fault


class _Stay(urllib.request.HTTPRedirectHandler):
    """Redirect handler that refuses redirects; urllib would send the key to the other host."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        return None
