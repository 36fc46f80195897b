"""Sockets that requests come in by: bound before anything is loaded, and closed so that nobody who
was let in is turned away."""

import ctypes
import socket
import struct
from collections.abc import Iterable, Sequence
from contextlib import suppress

from service.motion.errors import InvalidField

# linux/filter.h: load a byte, jump if a bit is set, return how much of a packet is kept.
_LOAD_BYTE, _JUMP_IF_SET, _RETURN = 0x30, 0x45, 0x06
_FLAGS, _SYN, _ALL = 13, 0x02, 0x40000
_DROP_SYN = (
    (_LOAD_BYTE, 0, 0, _FLAGS),
    (_JUMP_IF_SET, 0, 1, _SYN),
    (_RETURN, 0, 0, 0),
    (_RETURN, 0, 0, _ALL),
)
_ATTACH_FILTER = getattr(socket, "SO_ATTACH_FILTER", 26)


def bound(host: str, port: int) -> list[socket.socket]:
    """A socket for each address of a host, none listening yet; port 0 takes a free one, the same
    for all. InvalidField where an address cannot be had."""
    sockets: list[socket.socket] = []
    try:
        kind, passive = socket.SOCK_STREAM, socket.AI_PASSIVE
        found = socket.getaddrinfo(host or None, port, type=kind, flags=passive)
        for family, *_, where in dict.fromkeys(found):
            own = socket.socket(family, kind)
            sockets.append(own)
            own.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if family == socket.AF_INET6:
                own.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            own.bind((where[0], port, *where[2:]))
            port = own.getsockname()[1]
    except OSError as fault:
        close(sockets)
        said = (fault.strerror or str(fault)).lower()
        raise InvalidField("address", f"{host}:{port}: {said}") from fault
    return sockets


def address(sockets: Sequence[socket.socket]) -> str:
    """URL of the first."""
    host, port = sockets[0].getsockname()[:2]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


def turn_away(sockets: Iterable[socket.socket]) -> None:
    """Let no new connection begin; those that have begun can still be accepted.

    What is not yet accepted when a socket closes is reset, with the request that it may have
    brought. So packets that ask for a connection are dropped beforehand: who asked asks again a
    second later and is refused. Elsewhere than on Linux nothing is done.
    """
    code = b"".join(struct.pack("HBBI", *step) for step in _DROP_SYN)
    held = ctypes.create_string_buffer(code)
    program = struct.pack("HL", len(_DROP_SYN), ctypes.addressof(held))
    for own in sockets:
        with suppress(OSError):
            own.setsockopt(socket.SOL_SOCKET, _ATTACH_FILTER, program)


def close(sockets: Iterable[socket.socket]) -> None:
    """Close them all."""
    for own in sockets:
        own.close()
