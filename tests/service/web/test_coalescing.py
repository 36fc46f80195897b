"""Tests of write coalescing: one system call, with all data in order."""

import asyncio
import socket

import uvloop
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from posefield.http.server import MAX_BUFFER, CoalescingProtocol, CoalescingTransport


class Recorder(asyncio.Transport):
    """A transport that notes what each call gave it."""

    def __init__(self):
        super().__init__()
        self.calls, self.closed = [], False

    def writelines(self, pieces):
        self.calls.append(b"".join(pieces))

    def write(self, data):
        self.calls.append(bytes(data))

    def close(self):
        self.closed = True

    def is_closing(self):
        return self.closed

    def get_extra_info(self, name, default=None):
        return {"socket": "its own"}.get(name, default)


def scene(play):
    async def run():
        recorder = Recorder()
        await play(CoalescingTransport(recorder), recorder)
        return recorder.calls

    return asyncio.run(run())


def test_head_and_body_are_one_call_and_the_next_turn_another():
    async def play(transport, recorder):
        transport.write(b"head")
        transport.write(b"body")
        assert recorder.calls == []
        await asyncio.sleep(0)
        transport.writelines([b"more", b"still"])
        await asyncio.sleep(0)

    assert scene(play) == [b"headbody", b"morestill"]


def test_much_is_not_held_so_that_flow_control_sees_it():
    async def play(transport, recorder):
        transport.write(b"h")
        transport.write(b"x" * MAX_BUFFER)
        assert [len(call) for call in recorder.calls] == [MAX_BUFFER + 1]
        transport.write(b"rest")
        await asyncio.sleep(0)

    assert [len(call) for call in scene(play)] == [MAX_BUFFER + 1, 4]


def test_what_is_held_goes_before_the_end():
    async def play(transport, recorder):
        transport.write(b"last")
        assert not transport.is_closing()
        transport.close()
        assert recorder.closed and transport.is_closing()

    assert scene(play) == [b"last"]


def test_data_for_a_connection_that_was_reset_is_dropped_without_an_error():
    async def play():
        loop, errors = asyncio.get_running_loop(), []
        loop.set_exception_handler(lambda _, error: errors.append(error["exception"]))
        ours, theirs = socket.socketpair()
        direct, _ = await loop.create_connection(asyncio.Protocol, sock=ours)
        direct.abort()
        await asyncio.sleep(0.01)
        loop.call_soon(CoalescingTransport(direct).writelines, [b"an answer"])
        await asyncio.sleep(0.01)
        theirs.close()
        return errors

    assert uvloop.run(play()) == []


def test_the_parser_is_the_fast_one():
    """Without httptools uvicorn falls back to one that takes four times as long."""
    assert issubclass(CoalescingProtocol, HttpToolsProtocol)
