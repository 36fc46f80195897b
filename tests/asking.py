"""Helpers for requests to an app in this process or to a service, and for archives in responses."""

import asyncio
import io
import socket
import subprocess
import tarfile
import threading
import time
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import httpx
import serving
import uvicorn
from starlette.types import ASGIApp

Ask = Callable[..., httpx.Response]


def asker(app: ASGIApp) -> Ask:
    async def send(method: str, url: str, **content: Any) -> httpx.Response:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            return await client.request(method, url, **content)

    return lambda *args, **kwargs: asyncio.run(send(*args, **kwargs))


@contextmanager
def listening(app: ASGIApp) -> Iterator[str]:
    """Address of the app, which listens on a socket in a thread of this process."""
    config = uvicorn.Config(app, port=0, lifespan="off", log_config=None)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        while not server.started:
            time.sleep(0.01)
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()


@dataclass(frozen=True)
class Served:
    """A service in a process of its own, and where it listens."""

    child: subprocess.Popen[bytes]
    place: tuple[str, int]

    def expect_silence(self) -> None:
        """End it: it did so by itself, and has said nothing but where it listens."""
        self.child.terminate()
        assert self.child.wait(20) == 0
        assert self.child.stdout.read() == self.child.stderr.read() == b""


@contextmanager
def process(*paths: Path, **environ: str) -> Iterator[Served]:
    """The service as a process of its own; killed where the test leaves it running."""
    with serving.process(*paths, POSEFIELD_WORKERS="1", **environ) as child:
        yield Served(child, serving.host_and_port(serving.address(child)))


@dataclass(frozen=True)
class Answer:
    """An answer as it came over the wire."""

    status: int
    headers: dict[str, str]
    body: bytes


def exchange(
    place: tuple[str, int], content: bytes, size: int = 1 << 16, answers: int | None = 1
) -> list[Answer]:
    """Answers to bytes that are sent in pieces of a size; None: all until the connection ends."""
    with socket.create_connection(place, timeout=20) as wire:
        wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with suppress(ConnectionError):
            for start in range(0, len(content), size):
                wire.sendall(content[start : start + size])
        stream, found = wire.makefile("rb"), []
        while answers is None or len(found) < answers:
            answer = read_answer(stream)
            if answer is None:
                break
            found.append(answer)
        return found


def read_answer(stream: BinaryIO) -> Answer | None:
    """The next answer; None where the connection has ended."""
    line = stream.readline()
    if not line:
        return None
    headers = {}
    while (field := stream.readline().strip()) != b"":
        name, _, value = field.decode("latin-1").partition(": ")
        headers[name.lower()] = value
    if headers.get("transfer-encoding") == "chunked":
        body = b""
        while length := int(stream.readline(), 16):
            body += stream.read(length)
            stream.readline()
        stream.readline()
    else:
        body = stream.read(int(headers["content-length"]))
    return Answer(int(line.split()[1]), headers, body)


def unpacked(kind: str, content: bytes) -> dict[str, bytes]:
    """Names and contents in their order."""
    if kind == "tar":
        with tarfile.open(fileobj=io.BytesIO(content), mode="r:") as found:
            return {m.name: found.extractfile(m).read() for m in found.getmembers()}
    with zipfile.ZipFile(io.BytesIO(content)) as found:
        return {name: found.read(name) for name in found.namelist()}


def contains(whole: Any, part: Any) -> bool:
    """Return whether `part` is an excerpt of `whole`: fewer keys, the same values."""
    if isinstance(part, dict):
        return all(key in whole and contains(whole[key], part[key]) for key in part)
    if isinstance(part, list):
        return len(whole) == len(part) and all(map(contains, whole, part))
    return whole == part
