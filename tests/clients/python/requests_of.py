"""Requests that the client would send, without sending them."""

from typing import Any

import httpx
import msgspec
from posefield_client import Client
from posefield_client.client import Saving
from posefield_client.wire import Call


class Sent(Exception):
    """Request in place of its response."""


def _refuse(request: httpx.Request) -> httpx.Response:
    raise Sent(request)


CLIENT = Client("http://127.0.0.1:1", transport=httpx.MockTransport(_refuse), checks=False)


def request(saving: Saving, form: str) -> Call[Any]:
    """Return the request of a file."""
    return saving.files.request(form, lambda reply: reply.content)


def body(saving: Saving, form: str = "usdc") -> Any:
    """Return the body of a file's request."""
    return msgspec.json.decode(request(saving, form).body)


def sent(ask: Any) -> httpx.Request:
    """Return the request that `ask` makes a client send."""
    try:
        ask(CLIENT)
    except Sent as stop:
        return stop.args[0]
    raise AssertionError("nothing was sent")
